#pragma once

#include <compare>
#include <cstdint>
#include <string>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"

namespace axlecast {

// The identity of a log, from the event AXLECAST/recorder in its head. A renamed, repaired or compressed log keeps it.
struct LogKey {
  std::string name;  // of the log within `recorder.logs`, or of a recorder that the command line names
  std::string host;
  std::int64_t start_utime = 0;  // us, UNIX time
  std::int32_t file_number = 0;  // counts the logs of one process, from 0

  auto operator<=>(const LogKey&) const = default;
};

// The head of a log: what its first events contain.
struct LogHead {
  LogKey key;
  std::string machine;  // text of the machine's file
};

// Reads the head. `log`: the log, or its first kHeadBytes. Fails if the recorder of axlecast has not written the log, if the log is
// damaged there, or if a recorder without a machine's file has written it: the text states which.
inline constexpr std::size_t kHeadBytes = 4U << 20;
[[nodiscard]] Result<LogHead> ReadLogHead(Bytes log);

}  // namespace axlecast
