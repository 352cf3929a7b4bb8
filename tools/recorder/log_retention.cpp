#include "tools/recorder/log_retention.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "tools/log/log_name.h"

namespace axlecast {
namespace {

struct DatedLog {
  std::int64_t begin;
  StoredLog log;
};

// Returns the logs with generated names, oldest first.
std::vector<DatedLog> OwnLogs(std::vector<StoredLog> logs, std::string_view name) {
  std::vector<DatedLog> own;
  for (StoredLog& log : logs) {
    if (const auto begin = LogFileBegin(name, log.file)) own.push_back({*begin, std::move(log)});
  }
  std::sort(own.begin(), own.end(), [](const DatedLog& one, const DatedLog& other) {
    const std::size_t one_size = one.log.file.size();  // _1000 follows _999
    const std::size_t other_size = other.log.file.size();
    return std::tie(one.begin, one_size, one.log.file) < std::tie(other.begin, other_size, other.log.file);
  });
  return own;
}

// Returns the latest possible time of the last event (us, UNIX time).
std::int64_t EndOf(const std::vector<DatedLog>& logs, std::size_t i) {
  if (logs[i].log.last_utime > 0) return logs[i].log.last_utime;
  return i + 1 < logs.size() ? logs[i + 1].begin : std::numeric_limits<std::int64_t>::max();
}

}  // namespace

ExpiredLogs FindExpired(std::vector<StoredLog> logs, std::string_view name, std::string_view current,
                        const Retention& retention, std::int64_t utime) {
  const std::vector<DatedLog> own = OwnLogs(std::move(logs), name);
  std::int64_t bytes = std::accumulate(own.begin(), own.end(), std::int64_t{0},
                                       [](std::int64_t sum, const DatedLog& each) { return sum + each.log.bytes; });
  ExpiredLogs found;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const StoredLog& log = own[i].log;
    if (log.file == current) continue;
    const bool old = retention.keep_us > 0 && EndOf(own, i) < utime - retention.keep_us;
    const bool over = retention.quota_bytes > 0 && bytes > retention.quota_bytes && i + 1 < own.size();
    if (!old && !over) continue;
    if (retention.needs_shipping && !log.shipped) {
      found.held.push_back(log);
      continue;
    }
    bytes -= log.bytes;
    found.expired.push_back(log);
  }
  return found;
}

bool IsNearlyFull(const Retention& retention, std::int64_t size, std::int64_t free) {
  const double part = static_cast<double>(size) * retention.reserve_percent / 100;
  return free < retention.reserve_bytes || static_cast<double>(free) < part;
}

}  // namespace axlecast
