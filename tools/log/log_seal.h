#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "tools/log/log_event.h"

namespace axlecast {

// LCM's log has no checksum. The recorder leaves one as an ordinary event, which stock readers pass over: a seal on
// channel "AXLECAST/seal", about once a second and at the end, that tells how many bytes of records stand before it
// since the one before (or the log's start), how many events, and their CRC-32C (RFC 3720, appendix B.4).
inline constexpr std::string_view kSealChannel = "AXLECAST/seal";

struct LogSeal {
  std::uint64_t bytes = 0;   // of records since the seal before, without seals
  std::uint64_t events = 0;  // among them
  std::uint32_t crc32c = 0;  // of these bytes
  bool operator==(const LogSeal&) const = default;
};

// The data of a seal's event: 20 bytes, big-endian, in the order above.
[[nodiscard]] std::vector<std::uint8_t> EncodeSeal(const LogSeal& seal);
[[nodiscard]] std::optional<LogSeal> ParseSeal(Bytes data);

// CRC-32C of `data`, continuing `crc` (0 at the start).
[[nodiscard]] std::uint32_t Crc32c(std::uint32_t crc, Bytes data);

}  // namespace axlecast
