#pragma once

#include <string>
#include <string_view>

#include "core/base/result.h"

namespace axlecast {

// Where a program listens.
struct ListenAddress {
  std::string address = "127.0.0.1";  // an IP address of this host, or a wildcard; IPv6 without brackets
  int port = 0;                       // TCP, 1 to 65535
};

// Reads "8381", "192.0.2.7:8381" or "[::1]:8381". Without an address, only this host reaches the port.
[[nodiscard]] Result<ListenAddress> ParseListenAddress(std::string_view text);

// Returns "192.0.2.7:8381", and an IPv6 address in brackets.
[[nodiscard]] std::string ListenAddressText(const ListenAddress& listen);

}  // namespace axlecast
