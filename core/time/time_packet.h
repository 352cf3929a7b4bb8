#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/base/time.h"

namespace axlecast {

// The datagrams of a time exchange: a request, and the answer of the root. Both have the same length, so that a forged sender address
// gets no more bytes than the forger sends. Integers are big-endian; unused bytes are 0.
//
//   0  "AXT1"   4  kind   8  nonce   16  machine_id   24  base_id   32  asked   40  answered   48..63  unused
inline constexpr std::size_t kTimePacketBytes = 64;
using TimePacketBytes = std::array<std::uint8_t, kTimePacketBytes>;

struct TimePacket {
  enum class Kind : std::uint8_t { kRequest = 1, kAnswer = 2 };

  Kind kind = Kind::kRequest;
  std::int64_t nonce = 0;  // random; the answer repeats it, so that nobody who did not see the request can answer
  std::int64_t machine_id = 0;  // of both ends
  std::int64_t base_id = 0;     // the rest in answers only
  MonoNs asked = 0;             // ns of the base, read after the request had arrived
  MonoNs answered = 0;          // ns of the base, read before the answer left

  friend bool operator==(const TimePacket&, const TimePacket&) = default;
};

[[nodiscard]] TimePacketBytes Encoded(const TimePacket& packet);
// Returns nothing if the bytes are no datagram of a time exchange.
[[nodiscard]] std::optional<TimePacket> DecodedTimePacket(std::span<const std::uint8_t> bytes);

}  // namespace axlecast
