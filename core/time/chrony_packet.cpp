#include "core/time/chrony_packet.h"

#include <arpa/inet.h>

#include <cmath>

namespace axlecast {
namespace {

constexpr std::uint8_t kVersion = 6;
constexpr std::uint8_t kRequest = 1;
constexpr std::uint8_t kReply = 2;
constexpr std::uint32_t kTracking = 33;
constexpr std::uint32_t kTrackingReply = 5;
constexpr std::uint32_t kIPv4 = 1;
constexpr std::uint32_t kIPv6 = 2;
constexpr std::int64_t kMaxSeconds = std::int64_t{1} << 33;  // year 2242; UNIX time in ns has room until 2262
constexpr double kMaxFigure = 1e6;                           // s or ppm; above it, nothing is known

std::uint32_t Read16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) << 8 | bytes[at + 1];
}

std::uint32_t Read32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return Read16(bytes, at) << 16 | Read16(bytes, at + 2);
}

// A signed exponent of 7 bits and a signed coefficient of 25 bits: coefficient x 2^(exponent - 25).
double ReadFloat(std::span<const std::uint8_t> bytes, std::size_t at) {
  const std::uint32_t word = Read32(bytes, at);
  const auto exponent = static_cast<std::int32_t>(word) >> 25;
  const auto coefficient = static_cast<std::int32_t>(word << 7) >> 7;
  return std::ldexp(coefficient, exponent - 25);
}

// Returns the address, or the name of a reference clock: up to four letters in the id.
std::string Reference(std::span<const std::uint8_t> bytes, std::uint32_t id) {
  const std::uint32_t family = Read16(bytes, 48);
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (family == kIPv4 || family == kIPv6) {
    inet_ntop(family == kIPv4 ? AF_INET : AF_INET6, bytes.data() + 32, text.data(), text.size());
    return text.data();
  }
  std::string name;
  for (int shift = 24; shift >= 0; shift -= 8) {
    const char letter = static_cast<char>(id >> shift & 0x7fU);
    if (letter > ' ' && letter < '\x7f') name += letter;
  }
  return name;
}

bool IsPossible(const ChronyTracking& tracking) {
  for (const double figure : {tracking.correction_s, tracking.residual_frequency_ppm, tracking.skew_ppm,
                              tracking.root_delay_s, tracking.root_dispersion_s}) {
    if (!(std::abs(figure) <= kMaxFigure)) return false;
  }
  return tracking.skew_ppm >= 0 && tracking.root_dispersion_s >= 0;
}

}  // namespace

ChronyRequest TrackingRequest(std::uint32_t sequence) {
  ChronyRequest bytes{};
  bytes[0] = kVersion;
  bytes[1] = kRequest;
  bytes[5] = kTracking;
  for (std::size_t i = 0; i < 4; ++i) bytes[8 + i] = static_cast<std::uint8_t>(sequence >> (24 - 8 * i));
  return bytes;
}

std::optional<ChronyTracking> DecodedTracking(std::span<const std::uint8_t> bytes, std::uint32_t sequence) {
  if (bytes.size() != kChronyPacketBytes || bytes[0] != kVersion || bytes[1] != kReply) return std::nullopt;
  if (Read16(bytes, 4) != kTracking || Read16(bytes, 6) != kTrackingReply) return std::nullopt;
  if (Read16(bytes, 8) != 0 || Read32(bytes, 16) != sequence) return std::nullopt;
  ChronyTracking tracking;
  tracking.reference_id = Read32(bytes, 28);
  tracking.reference = Reference(bytes, tracking.reference_id);
  tracking.stratum = static_cast<int>(Read16(bytes, 52));
  tracking.leap = static_cast<int>(Read16(bytes, 54));
  // The high half is 0x7fffffff if the sender has 32 bits of seconds only.
  const std::uint32_t high = Read32(bytes, 56);
  const std::int64_t seconds = std::int64_t{high == 0x7fffffff ? 0 : high} << 32 | Read32(bytes, 60);
  if (seconds < 0 || seconds > kMaxSeconds) return std::nullopt;
  tracking.reference_utc_ns = seconds * 1'000'000'000 + Read32(bytes, 64) % 1'000'000'000;
  tracking.correction_s = ReadFloat(bytes, 68);
  tracking.residual_frequency_ppm = ReadFloat(bytes, 84);
  tracking.skew_ppm = ReadFloat(bytes, 88);
  tracking.root_delay_s = ReadFloat(bytes, 92);
  tracking.root_dispersion_s = ReadFloat(bytes, 96);
  if (!IsPossible(tracking)) return std::nullopt;
  return tracking;
}

}  // namespace axlecast
