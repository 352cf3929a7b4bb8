#pragma once

#include <cstddef>
#include <cstdint>

#include "tools/log/log_seal.h"

namespace axlecast {

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
