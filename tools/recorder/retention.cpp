#include "tools/recorder/retention.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <ctime>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

namespace axlecast {
namespace {

constexpr std::string_view kEnding = ".lcm";
constexpr std::size_t kStamp = 16;  // 20261121T070005Z

bool AreDigits(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

// Returns us, UNIX time.
std::optional<std::int64_t> ParseStamp(std::string_view stamp) {
  if (stamp.size() != kStamp || !AreDigits(stamp.substr(0, 8)) || stamp[8] != 'T' ||
      !AreDigits(stamp.substr(9, 6)) || stamp[15] != 'Z') {
    return std::nullopt;
  }
  std::tm date{};
  if (strptime(std::string(stamp).c_str(), "%Y%m%dT%H%M%SZ", &date) == nullptr) return std::nullopt;
  return std::int64_t{timegm(&date)} * 1'000'000;
}

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

std::string LogFileName(std::string_view name, std::int64_t utime, int copy) {
  const std::time_t seconds = utime / 1'000'000;
  std::tm date{};
  gmtime_r(&seconds, &date);
  std::array<char, 32> stamp{};
  std::strftime(stamp.data(), stamp.size(), "%Y%m%dT%H%M%SZ", &date);
  std::array<char, 16> suffix{};
  if (copy > 0) static_cast<void>(std::snprintf(suffix.data(), suffix.size(), "_%03d", copy));
  return std::string(name) + '_' + stamp.data() + suffix.data() + std::string(kEnding);
}

std::optional<std::int64_t> LogFileBegin(std::string_view name, std::string_view file) {
  if (!file.starts_with(name) || !file.ends_with(kEnding)) return std::nullopt;
  file.remove_prefix(name.size());
  if (file.size() < 1 + kStamp + kEnding.size() || file[0] != '_') return std::nullopt;
  file.remove_prefix(1);
  file.remove_suffix(kEnding.size());
  const std::string_view copy = file.substr(kStamp);
  if (!copy.empty() && (copy.size() < 4 || copy[0] != '_' || !AreDigits(copy.substr(1)))) return std::nullopt;
  return ParseStamp(file.substr(0, kStamp));
}

std::vector<std::string> ExpiredLogs(std::vector<StoredLog> logs, std::string_view name, std::string_view current,
                                     const Retention& retention, std::int64_t utime) {
  const std::vector<DatedLog> own = OwnLogs(std::move(logs), name);
  std::int64_t bytes = std::accumulate(own.begin(), own.end(), std::int64_t{0},
                                       [](std::int64_t sum, const DatedLog& each) { return sum + each.log.bytes; });
  std::vector<std::string> expired;
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (own[i].log.file == current) continue;
    const bool old = retention.keep_us > 0 && EndOf(own, i) < utime - retention.keep_us;
    const bool over = retention.quota_bytes > 0 && bytes > retention.quota_bytes && i + 1 < own.size();
    if (!old && !over) continue;
    bytes -= own[i].log.bytes;
    expired.push_back(own[i].log.file);
  }
  return expired;
}

}  // namespace axlecast
