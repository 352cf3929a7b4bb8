#include "core/config/recorder_config.h"

#include <algorithm>

#include "core/base/expression.h"

namespace axlecast {
namespace {

constexpr std::int64_t kMinSplit = 1 << 20;  // bytes: every log carries some 60 kB of header
constexpr std::int64_t kMinBuffer = 16 << 10;
constexpr int kLogsKept = 8;  // unless split_size or split_time say otherwise
constexpr MonoNs kDay = 86'400 * kSecond;

}  // namespace

std::vector<LogFault> FaultsOf(const LogConfig& log) {
  std::vector<LogFault> faults;
  const auto require = [&faults](bool holds, const char* key, const char* text) {
    if (!holds) faults.push_back({key, text});
  };
  std::string problem;
  if (!log.channels.empty() && !CompileExpression(log.channels, problem)) faults.push_back({"channels", problem});
  if (!log.trigger.empty() && !CompileExpression(log.trigger, problem)) faults.push_back({"trigger", problem});
  require(!log.invert || !log.channels.empty(), "invert", "needs channels: the expression that is inverted");
  require(log.split_bytes == 0 || log.split_bytes >= kMinSplit, "split_size", "is at least 1MB");
  require(log.quota_bytes == 0 || log.quota_bytes >= 2 * kMinSplit, "quota", "is at least 2MB");
  require(log.quota_bytes == 0 || log.split_bytes <= log.quota_bytes / 2, "split_size",
          "is at most half of the quota: the log being written is never deleted");
  require(log.split_time == 0 || log.split_time >= kSecond, "split_time", "is at least 1s");
  require(log.keep == 0 || log.keep >= 60 * kSecond, "keep", "is at least 1m");
  require(log.keep == 0 || log.split_time <= log.keep, "split_time",
          "is at most as long as keep: the log being written is never deleted");
  require(log.buffer_bytes >= kMinBuffer, "buffer", "is at least 16kB");
  require(log.trigger.empty() || log.pre_trigger > 0, "trigger", "needs a pre_trigger beside it: 30s");
  require(!log.trigger.empty() || log.pre_trigger == 0, "pre_trigger", "needs a trigger beside it");
  require(log.pre_trigger <= 3'600 * kSecond, "pre_trigger", "is at most 1h: it is kept in memory");
  require(log.post_trigger <= kDay, "post_trigger", "is at most 1d");
  return faults;
}

std::int64_t SplitBytes(const LogConfig& log) {
  if (log.split_bytes > 0 || log.quota_bytes == 0) return log.split_bytes;
  return std::max(kMinSplit, log.quota_bytes / kLogsKept);
}

MonoNs SplitTime(const LogConfig& log) {
  if (log.split_time > 0 || log.keep == 0) return log.split_time;
  return std::clamp(log.keep / kLogsKept, kSecond, kDay);
}

}  // namespace axlecast
