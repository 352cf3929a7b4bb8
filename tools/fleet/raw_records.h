#pragma once

#include <cstdint>
#include <vector>

#include "core/base/result.h"
#include "tools/fleet/rows.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Collects records of a log and compresses them.
class RawRecords {
 public:
  void Add(const LogEvent& event);
  [[nodiscard]] bool empty() const { return row_.n == 0; }
  // Returns the records since the last call as one row. Call it only if there are any.
  [[nodiscard]] RawRow Take();

 private:
  std::vector<std::uint8_t> records_;
  RawRow row_;
};

// Returns the records of a row, byte for byte as the log has them. Fails if the row was damaged: its CRC, the number of its
// records and the number of the first are checked. Never returns more than kLargestRaw bytes.
inline constexpr std::size_t kLargestRaw = std::size_t{1} << 30;
[[nodiscard]] Result<std::vector<std::uint8_t>> DecodeRaw(const RawRow& row);

}  // namespace axlecast
