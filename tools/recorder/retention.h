#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// The logs that a recorder has named itself: NAME_YYYYMMDDTHHMMSSZ.lcm, and _001, _002, ... before the ending where
// several began in one second. UTC.

// `copy`: 0 for the plain name.
[[nodiscard]] std::string LogFileName(std::string_view name, std::int64_t utime, int copy);

// When the log of this name began (us, UNIX time); nothing where it is none of the recorder's.
[[nodiscard]] std::optional<std::int64_t> LogFileBegin(std::string_view name, std::string_view file);

struct StoredLog {
  std::string file;
  std::int64_t bytes = 0;
  std::int64_t last_utime = 0;  // of its last event (us, UNIX time); 0: not known
};

struct Retention {
  std::int64_t quota_bytes = 0;  // 0: no limit
  std::int64_t keep_us = 0;      // 0: for ever
};

// Which of the recorder's logs must go, oldest first: until the rest fits the quota, and those whose last event is older
// than what is kept. Where that event is not known, a log ends when the next one begins. Never `current`, nor the newest
// for the quota, nor another file.
[[nodiscard]] std::vector<std::string> ExpiredLogs(std::vector<StoredLog> logs, std::string_view name,
                                                   std::string_view current, const Retention& retention,
                                                   std::int64_t utime);

}  // namespace axlecast
