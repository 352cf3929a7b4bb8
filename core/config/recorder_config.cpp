#include "core/config/recorder_config.h"

#include <algorithm>

#include "core/base/expression.h"
#include "core/base/spelling.h"
#include "core/config/config_map.h"

namespace axlecast {
namespace {

constexpr std::int64_t kMinSplit = 1 << 20;  // bytes: every log carries some 60 kB of header
constexpr std::int64_t kMinBuffer = 16 << 10;
constexpr int kLogsKept = 8;  // unless split_size or split_time say otherwise
constexpr MonoNs kDay = 86'400 * kSecond;

constexpr std::size_t kMaxLogs = 16;

LogConfig LoadLog(const std::string& name, ConfigMap& map) {
  LogConfig log;
  log.name = name;
  if (!IsName(name)) map.errors().Add(map.mark(), map.path() + ": " + Quoted(name) + kNameRule);
  log.channels = map.String("channels", "");
  log.invert = map.Bool("invert", false);
  log.split_bytes = map.Size("split_size", log.split_bytes);
  log.split_time = map.Time("split_time", log.split_time);
  log.quota_bytes = map.Size("quota", log.quota_bytes);
  log.keep = map.Time("keep", log.keep);
  log.sync =
      map.Integer("fsync_ms", log.sync / kMillisecond, 0, 3'600'000, "ms (0: after every write)") * kMillisecond;
  log.buffer_bytes = map.Size("buffer", log.buffer_bytes);
  log.trigger = map.String("trigger", "");
  log.pre_trigger = map.Time("pre_trigger", log.pre_trigger);
  log.post_trigger = map.Time("post_trigger", log.post_trigger);
  for (const LogFault& fault : FaultsOf(log)) map.Error(fault.key, fault.text);
  map.Done();
  return log;
}

}  // namespace

std::vector<LogFault> FaultsOf(const LogConfig& log) {
  std::vector<LogFault> faults;
  const auto require = [&faults](bool holds, const char* key, const char* text) {
    if (!holds) faults.push_back({key, text});
  };
  const auto require_expression = [&faults](const std::string& text, const char* key) {
    if (text.empty()) return;
    if (const auto expression = CompileExpression(text); !expression)
      faults.push_back({key, expression.error().text});
  };
  require_expression(log.channels, "channels");
  require_expression(log.trigger, "trigger");
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

RecorderConfig LoadRecorder(ConfigMap map) {
  RecorderConfig recorder;
  recorder.directory = map.String("directory", "");
  if (map.Has("directory") && !recorder.directory.starts_with('/')) {
    map.Error("directory", Quoted(recorder.directory) + " is no absolute path, e.g. /var/log/axlecast");
  }
  map.MarkRequired("logs");
  auto logs = map.Maps("logs");
  const bool stands = map.node().IsDefined() && (map.node().IsMap() || map.node().IsNull());
  if (stands && logs.empty()) {
    map.Error("logs", "is missing or empty: name at least one log, e.g. {all: {quota: 20GB}}");
  }
  if (logs.size() > kMaxLogs) {
    map.Error("logs", std::to_string(logs.size()) + " logs: at most " + std::to_string(kMaxLogs) +
                          ", because each hears all messages by itself");
  } else {
    for (auto& [name, log] : logs) recorder.logs.push_back(LoadLog(name, log));
  }
  map.Done();
  return recorder;
}

}  // namespace axlecast
