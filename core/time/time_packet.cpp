#include "core/time/time_packet.h"

#include <algorithm>

namespace axlecast {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic = {'A', 'X', 'T', '1'};
constexpr std::size_t kKindAt = 4;
constexpr std::size_t kNonceAt = 8;
constexpr std::size_t kMachineAt = 16;
constexpr std::size_t kBaseAt = 24;
constexpr std::size_t kAskedAt = 32;
constexpr std::size_t kAnsweredAt = 40;

void Put(TimePacketBytes& bytes, std::size_t at, std::int64_t value) {
  for (std::size_t i = 0; i < 8; ++i)
    bytes.at(at + i) = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (56 - 8 * i));
}

std::int64_t Get(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes.subspan(at, 8)) value = value << 8U | byte;
  return static_cast<std::int64_t>(value);
}

}  // namespace

TimePacketBytes Encoded(const TimePacket& packet) {
  TimePacketBytes bytes{};
  std::copy(kMagic.begin(), kMagic.end(), bytes.begin());
  bytes[kKindAt] = static_cast<std::uint8_t>(packet.kind);
  Put(bytes, kNonceAt, packet.nonce);
  Put(bytes, kMachineAt, packet.machine_id);
  Put(bytes, kBaseAt, packet.base_id);
  Put(bytes, kAskedAt, packet.asked);
  Put(bytes, kAnsweredAt, packet.answered);
  return bytes;
}

std::optional<TimePacket> DecodedTimePacket(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kTimePacketBytes || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin()))
    return std::nullopt;
  const auto kind = static_cast<TimePacket::Kind>(bytes[kKindAt]);
  if (kind != TimePacket::Kind::kRequest && kind != TimePacket::Kind::kAnswer) return std::nullopt;
  return TimePacket{.kind = kind,
                    .nonce = Get(bytes, kNonceAt),
                    .machine_id = Get(bytes, kMachineAt),
                    .base_id = Get(bytes, kBaseAt),
                    .asked = Get(bytes, kAskedAt),
                    .answered = Get(bytes, kAnsweredAt)};
}

}  // namespace axlecast
