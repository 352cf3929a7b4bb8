#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "tools/log/log_event.h"

namespace axlecast {

// LCM's log has no checksum. The recorder therefore writes seals as ordinary events on this channel, about once a second and at
// the end. Stock readers ignore them. A seal contains the size, the number and the CRC-32C (RFC 3720, appendix B.4) of the
// records since the previous seal, or since the start of the log.
inline constexpr std::string_view kSealChannel = "AXLECAST/seal";

struct LogSeal {
  std::uint64_t bytes = 0;   // of records since the previous seal, without seals
  std::uint64_t events = 0;  // number of these records
  std::uint32_t crc32c = 0;  // of these bytes
  bool operator==(const LogSeal&) const = default;
};

// Encodes the data of a seal's event: 20 bytes, big-endian, in the order of the fields.
[[nodiscard]] std::vector<std::uint8_t> EncodeSeal(const LogSeal& seal);
[[nodiscard]] std::optional<LogSeal> ParseSeal(Bytes data);

// Returns the CRC-32C of `data`, continued from `crc` (0 at the start).
[[nodiscard]] std::uint32_t Crc32c(std::uint32_t crc, Bytes data);

// Calculates the next seal from the records since the last one, while they are written or read.
class SealCount {
 public:
  // `record`: a complete record that is not a seal.
  void Add(Bytes record);
  [[nodiscard]] const LogSeal& seal() const { return seal_; }
  void Reset() { seal_ = {}; }  // after a seal

 private:
  LogSeal seal_;
};

// The state in which a recorder continues an existing log, whose last record may be torn.
struct LogTail {
  std::size_t size = 0;          // of the log without a torn record at its end: truncate the file to this size
  std::int64_t next_number = 0;  // of the next event
  SealCount open;                // the records that no seal covers yet
  std::size_t torn = 0;          // bytes after `size`
};

// Many times the distance between two seals.
inline constexpr std::size_t kTailBytes = 4 * kLargestLogData;

// Reads the last `look` bytes of the log. If they contain no seal, reads the whole log.
[[nodiscard]] LogTail FindTail(Bytes log, std::size_t look = kTailBytes);

}  // namespace axlecast
