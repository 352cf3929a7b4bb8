#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "core/base/inline_bytes.h"

namespace axlecast {

// The datagrams of LCM's UDP multicast protocol (LCM 1.3.1 documentation, "UDP Multicast Protocol Description"),
// big-endian. Short: u32 0x4c433032, u32 sequence, channel, NUL, payload. Fragment: u32 0x4c433033, u32 sequence, u32
// payload size, u32 fragment offset, u16 fragment number, u16 fragments, then (in fragment 0) channel and NUL, then the
// fragment's payload. A sender numbers messages, not datagrams, from 0, and wraps around.
struct ShortPacket {
  std::uint32_t sequence = 0;
  std::string_view channel;
  Bytes payload;
};

struct FragmentPacket {
  std::uint32_t sequence = 0;
  std::uint32_t size = 0;    // of the whole message
  std::uint32_t offset = 0;  // of this payload in it
  std::uint16_t number = 0;  // of this fragment, from 0
  std::uint16_t count = 0;   // of fragments
  std::string_view channel;  // in fragment 0, else empty
  Bytes payload;
};

using UdpmPacket = std::variant<ShortPacket, FragmentPacket>;

inline constexpr std::size_t kLongestChannel = 63;        // without the NUL; lcm_udpm.c
inline constexpr std::size_t kLargestMessage = 1U << 28;  // bytes; LCM's own limit (lcm_udpm.c)

// What the datagram holds; its views live in `datagram`. Nothing where it is none of LCM's, is cut, names no channel
// (no event log can hold such a message), or contradicts itself.
[[nodiscard]] std::optional<UdpmPacket> ParseUdpm(Bytes datagram);

}  // namespace axlecast
