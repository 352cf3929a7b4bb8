#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// A log in the folder of a recorder.
struct StoredLog {
  std::string file;             // PlainLogName
  std::int64_t bytes = 0;       // of its file, or of both forms
  std::int64_t last_utime = 0;  // of its last event (us, UNIX time); 0: unknown
  bool shipped = false;         // completely in the database (tools/log/shipped_logs.h)
};

struct Retention {
  std::int64_t quota_bytes = 0;    // 0: no limit
  std::int64_t keep_us = 0;        // 0: no limit
  bool needs_shipping = false;     // a log is deleted only if it is shipped, unless the disk is nearly full
  std::int64_t reserve_bytes = 0;  // a disk with less free space is nearly full
  double reserve_percent = 0;      // likewise, of its size; the greater of the two counts
};

struct ExpiredLogs {
  std::vector<StoredLog> expired;  // to delete, oldest first
  std::vector<StoredLog> held;     // would be deleted, but are not shipped; oldest first
};

// Returns the expired logs of the recorder:
// - as many as necessary for the quota, but never the newest log. A log that is held counts, so that newer ones go in its place.
// - those whose last event is older than keep_us. If the last event is unknown, a log ends when the next one begins.
// Never returns `current` or a file with another name.
[[nodiscard]] ExpiredLogs FindExpired(std::vector<StoredLog> logs, std::string_view name, std::string_view current,
                                      const Retention& retention, std::int64_t utime);

// Returns true if the disk has less free space than the reserve. `size`, `free`: bytes.
[[nodiscard]] bool IsNearlyFull(const Retention& retention, std::int64_t size, std::int64_t free);

}  // namespace axlecast
