#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace axlecast {

// An LCM URL as this product accepts it: udpm://GROUP:PORT[?ttl=0..255][&recv_buf_size=BYTES], or memq:// within
// one process. LCM itself passes over what it does not know.
struct LcmUrl {
  bool in_process = false;  // memq://
  std::string group;
  std::int64_t port = 0;
  int ttl = 0;                     // 0: this host only
  std::int64_t recv_buf_size = 0;  // bytes; 0: not given
};
// The error continues a sentence that begins with the URL: "has no port (1 to 65535), e.g. ...".
[[nodiscard]] Result<LcmUrl> ParseLcmUrl(std::string_view url);

// tcpq:// and file://: LCM's other providers. No machine runs over them, but tools may read from them.
[[nodiscard]] bool IsOtherProvider(std::string_view url);

// The address of a sender, from the kernel.
struct SenderAddress {
  std::uint32_t address = 0;  // IPv4, host order
  std::uint16_t port = 0;
  auto operator<=>(const SenderAddress&) const = default;
};

}  // namespace axlecast
