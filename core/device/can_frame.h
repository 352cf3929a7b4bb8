#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// In the upper bits of an identifier, as Linux has them (linux/can.h): 29 bits instead of 11; a request without data;
// no frame of the bus but a report of the controller's.
inline constexpr std::uint32_t kCanExtended = 0x8000'0000U;
inline constexpr std::uint32_t kCanRemote = 0x4000'0000U;
inline constexpr std::uint32_t kCanError = 0x2000'0000U;
inline constexpr std::uint32_t kCanStandardMask = 0x7FFU;
inline constexpr std::uint32_t kCanExtendedMask = 0x1FFF'FFFFU;

inline constexpr std::size_t kMaxCanData = 8;

// One frame of classical CAN (ISO 11898-1).
struct CanFrame {
  std::uint32_t id = 0;  // with kCanExtended, kCanRemote, kCanError
  InlineBytes<kMaxCanData> data;
};

// Time on the wire of a data frame with an 11-bit identifier (ISO 11898-1 10.4): 44 bits and the data; of these 34
// and the data are subject to stuffing, at most one bit after the first five and then after each four.
struct CanFrameTime {
  std::int64_t bitrate = 0;  // bit/s; 0: on a simulated wire, which may be faster than any: no time

  // From the first bit to the last but one, when receivers take it as valid.
  [[nodiscard]] constexpr MonoNs Shortest(std::size_t data) const { return Bits(43 + 8 * data); }
  // With every stuff bit that there can be, and the three bits between frames.
  [[nodiscard]] constexpr MonoNs Longest(std::size_t data) const {
    return Bits(47 + 8 * data + (33 + 8 * data) / 4);
  }

 private:
  [[nodiscard]] constexpr MonoNs Bits(std::size_t bits) const {
    return bitrate == 0 ? 0 : static_cast<MonoNs>(bits) * kSecond / bitrate;
  }
};

// What of a bus somebody wants to hear: frames whose identifier, flags included, equals `id` in the bits of `mask`.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
};
using CanFilters = std::vector<CanFilter>;

// Exactly this 11-bit identifier, with data: neither extended nor remote frames of the same number.
[[nodiscard]] constexpr CanFilter OnlyStandard(std::uint32_t id) {
  return {.id = id, .mask = kCanExtended | kCanRemote | kCanStandardMask};
}
[[nodiscard]] constexpr bool Passes(const CanFilter& filter, std::uint32_t id) {
  return (id & filter.mask) == (filter.id & filter.mask);
}

// A frame as a packet of bytes: the identifier with its flags, four bytes, most significant first; then the data.
// Simulated buses carry these.
using CanPacket = InlineBytes<4 + kMaxCanData>;
[[nodiscard]] constexpr CanPacket ToPacket(const CanFrame& frame) {
  CanPacket packet;
  for (int shift = 24; shift >= 0; shift -= 8) packet.Append(static_cast<std::uint8_t>(frame.id >> shift));
  packet.Append(frame.data);
  return packet;
}
// Nothing when it is no frame: shorter than an identifier, or with more than 8 bytes of data.
[[nodiscard]] constexpr std::optional<CanFrame> FromPacket(Bytes packet) {
  if (packet.size() < 4 || packet.size() > 4 + kMaxCanData) return std::nullopt;
  CanFrame frame;
  for (std::size_t i = 0; i < 4; ++i) frame.id = frame.id << 8 | packet[i];
  frame.data.Append(packet.subspan(4));
  return frame;
}

}  // namespace axlecast
