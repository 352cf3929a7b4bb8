#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// Generated names of logs: NAME_YYYYMMDDTHHMMSSZ.lcm (UTC). If several logs begin in one second, _001, _002, ... precede the
// extension.

// Returns the generated name. `copy`: 0 for the name without a number.
[[nodiscard]] std::string LogFileName(std::string_view name, std::int64_t utime, int copy);

// Returns the start of the log with this file name (us, UNIX time), or nothing if the recorder did not generate the name.
[[nodiscard]] std::optional<std::int64_t> LogFileBegin(std::string_view name, std::string_view file);

struct StoredLog {
  std::string file;
  std::int64_t bytes = 0;
  std::int64_t last_utime = 0;  // of its last event (us, UNIX time); 0: unknown
};

struct Retention {
  std::int64_t quota_bytes = 0;  // 0: no limit
  std::int64_t keep_us = 0;      // 0: no limit
};

// Returns the logs of the recorder to delete, oldest first:
// - as many as necessary for the quota, but never the newest log
// - those whose last event is older than keep_us. If the last event is unknown, a log ends when the next one begins.
// Never returns `current` or a file with another name.
[[nodiscard]] std::vector<std::string> ExpiredLogs(std::vector<StoredLog> logs, std::string_view name,
                                                   std::string_view current, const Retention& retention,
                                                   std::int64_t utime);

}  // namespace axlecast
