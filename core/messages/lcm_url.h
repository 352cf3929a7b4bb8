#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace axlecast {

// An LCM URL as this product accepts it: udpm://GROUP:PORT[?ttl=0..255][&recv_buf_size=BYTES][&interface=INTERFACE], or memq://
// within one process. LCM itself ignores options that it does not know. GROUP is an IPv4 group, or an IPv6 group in brackets, which
// needs an interface. liblcm has IPv4 only.
struct LcmUrl {
  bool in_process = false;  // memq://
  std::string group;        // without brackets
  std::int64_t port = 0;
  int ttl = 0;                     // 0: this host only. With IPv6, the hop limit
  std::int64_t recv_buf_size = 0;  // bytes; 0: not given
  std::string interface = {};      // IsInterface; empty: the kernel's route selects one

  [[nodiscard]] bool IsIPv6() const { return group.find(':') != std::string::npos; }
};
// The error continues a sentence that begins with the URL: "has no port (1 to 65535), e.g. ...".
[[nodiscard]] Result<LcmUrl> ParseLcmUrl(std::string_view url);

// Returns the udpm:// URL with the option interface=INTERFACE behind its other options; any other URL unchanged.
[[nodiscard]] std::string WithInterface(const std::string& url, std::string_view interface);

// Returns true if the text can select an interface of a host: by its name (eth1), by one of its addresses (192.168.5.1), or by
// a network (192.168.5.0/24) in which it has an address. The network is the same for all hosts of a machine.
[[nodiscard]] bool IsInterface(std::string_view text);
inline constexpr const char* kInterfaceRule =
    " is no interface: right is its name (eth1), its address (192.168.5.1) or its network (192.168.5.0/24)";

// tcpq:// and file://: LCM's other providers. No machine runs over them, but tools may read from them.
[[nodiscard]] bool IsOtherProvider(std::string_view url);

// The address of a sender, from the kernel: IPv6, or IPv4 as ::ffff:a.b.c.d (RFC 4291, section 2.5.5.2).
struct SenderAddress {
  std::array<std::uint8_t, 16> address{};
  std::uint16_t port = 0;

  // `address` is in host order.
  [[nodiscard]] static constexpr SenderAddress OfIPv4(std::uint32_t address, std::uint16_t port) {
    SenderAddress sender;
    sender.address[10] = sender.address[11] = 0xff;
    for (std::size_t i = 0; i < 4; ++i) sender.address[12 + i] = static_cast<std::uint8_t>(address >> (24 - 8 * i));
    sender.port = port;
    return sender;
  }

  auto operator<=>(const SenderAddress&) const = default;
};

// For std::unordered_map.
struct SenderHash {
  [[nodiscard]] std::size_t operator()(const SenderAddress& sender) const {
    const std::string_view bytes(reinterpret_cast<const char*>(sender.address.data()), sender.address.size());
    return std::hash<std::string_view>()(bytes) * 31 + sender.port;
  }
};

// Returns "192.168.5.1:40001" or "[fd00::1]:40001".
[[nodiscard]] std::string SenderText(const SenderAddress& sender);

}  // namespace axlecast
