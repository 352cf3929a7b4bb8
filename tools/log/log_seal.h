#pragma once

#include <cstddef>
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

// What the next seal tells: counts the records behind the last one, as they are written or read.
class SealCount {
 public:
  // `record`: a whole one, of no seal.
  void Add(Bytes record);
  [[nodiscard]] const LogSeal& seal() const { return seal_; }
  void Reset() { seal_ = {}; }  // behind a seal

 private:
  LogSeal seal_;
};

// Where a recorder goes on in a log that is there already, and may be torn.
struct LogTail {
  std::size_t size = 0;          // of the log without a torn record at its end: what to cut it to
  std::int64_t next_number = 0;  // of the next event
  SealCount open;                // the records that no seal covers yet
  std::size_t torn = 0;          // bytes behind `size`
};

// Many times what stands between two seals.
inline constexpr std::size_t kTailLook = 4 * kLargestLogData;

// Reads the log's last `look` bytes only where a seal stands in them, else all of it.
[[nodiscard]] LogTail FindTail(Bytes log, std::size_t look = kTailLook);

}  // namespace axlecast
