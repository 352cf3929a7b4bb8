#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// Flags in the upper bits of an identifier, as in linux/can.h: a 29-bit identifier, a remote frame, an error report of the
// controller.
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

// Frames to receive: those whose identifier, flags included, equals `id` in the bits of `mask`.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
};
using CanFilters = std::vector<CanFilter>;

// Returns a filter for data frames with this 11-bit identifier: no extended and no remote frames.
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
// Returns nothing if the packet is shorter than an identifier or has more than 8 bytes of data.
[[nodiscard]] constexpr std::optional<CanFrame> FromPacket(Bytes packet) {
  if (packet.size() < 4 || packet.size() > 4 + kMaxCanData) return std::nullopt;
  CanFrame frame;
  for (std::size_t i = 0; i < 4; ++i) frame.id = frame.id << 8 | packet[i];
  frame.data.Append(packet.subspan(4));
  return frame;
}

// The state of a CAN controller and its interface, as the kernel reports it. Counters start when the link is opened.
struct CanController {
  // ISO 11898-1 10.12 and Linux (CAN_STATE_*): its recent errors on the bus.
  enum class State : std::uint8_t {
    kUnknown,  // the interface does not report it (vcan)
    kActive,   // error active, both counters below 96
    kWarning,  // a counter has reached 96
    kPassive,  // a counter has reached 128: it sends no active error flags any more
    kBusOff,   // the transmit counter has passed 255: it takes no part in the bus until it is restarted
    kStopped,  // the interface is down
  };

  State state = State::kUnknown;
  int tec = -1;                     // transmit error counter; -1: not reported
  int rec = -1;                     // receive error counter; -1: not reported
  std::int64_t bitrate = 0;         // of the interface, bit/s; 0: not reported
  std::int64_t restart_ms = 0;      // delay of the automatic restart after a bus-off; 0: no automatic restart
  std::int64_t bus_offs = 0;        // error frames that reported a bus-off
  std::int64_t restarts = 0;        // after a bus-off
  std::int64_t bus_errors = 0;      // error frames of the protocol: bit, stuff, form, CRC
  std::int64_t unacknowledged = 0;  // own frames that no node acknowledged
  std::int64_t overruns = 0;        // frames that the controller itself lost
  std::int64_t queue_full = 0;      // own frames that the interface's queue or the controller did not take
  std::int64_t pending = 0;         // own frames sent and not yet acknowledged; the controller repeats them
  std::int64_t dropped = 0;         // received, and lost because the socket's buffer was full
};

// Commands that an operator types as root for a CAN interface.

// Returns the command for an interface that is down: "ip link set can0 up type can bitrate 250000 restart-ms 100". It restarts
// 100 ms after a bus-off; leave this out with `restarts` false. With `bitrate` 0, the text contains BITRATE instead.
[[nodiscard]] std::string CanUpLine(std::string_view interface, std::int64_t bitrate, bool restarts);
// Returns the command for an interface that is up and must go down before its settings change.
[[nodiscard]] std::string CanAgainLine(std::string_view interface, std::int64_t bitrate, bool restarts);
// Returns the command after a bus-off, with unchanged settings. Unlike `type can restart`, it works with every adapter.
[[nodiscard]] std::string CanRestartLine(std::string_view interface);

}  // namespace axlecast
