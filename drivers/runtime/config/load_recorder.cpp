#include "drivers/runtime/config/load_recorder.h"

#include "drivers/runtime/config/quantity.h"
#include "drivers/runtime/config/words.h"

namespace axlecast {
namespace {

constexpr std::size_t kMostLogs = 16;

void LoadTime(ConfigMap& map, const char* key, MonoNs& time) {
  if (!map.Has(key)) return;
  const std::string text = map.String(key, "0s");  // after an error
  const auto value = ParseTime(text);
  if (!value) map.Error(key, Quoted(text) + " is not " + kTimeRule);
  time = value.value_or(time);
}

void LoadSize(ConfigMap& map, const char* key, std::int64_t& bytes) {
  if (!map.Has(key)) return;
  const std::string text = map.String(key, "0kB");  // after an error
  const auto value = ParseSize(text);
  if (!value) map.Error(key, Quoted(text) + " is not " + kSizeRule);
  bytes = value.value_or(bytes);
}

LogConfig LoadLog(const std::string& name, ConfigMap& map) {
  LogConfig log;
  log.name = name;
  if (!IsName(name)) map.errors().Add(map.mark(), map.path() + ": " + Quoted(name) + kNameRule);
  log.channels = map.String("channels", "");
  log.invert = map.Bool("invert", false);
  LoadSize(map, "split_size", log.split_bytes);
  LoadTime(map, "split_time", log.split_time);
  LoadSize(map, "quota", log.quota_bytes);
  LoadTime(map, "keep", log.keep);
  log.sync =
      map.Integer("fsync_ms", log.sync / kMillisecond, 0, 3'600'000, "ms (0: after every write)") * kMillisecond;
  LoadSize(map, "buffer", log.buffer_bytes);
  log.trigger = map.String("trigger", "");
  LoadTime(map, "pre_trigger", log.pre_trigger);
  LoadTime(map, "post_trigger", log.post_trigger);
  for (const LogFault& fault : FaultsOf(log)) map.Error(fault.key, fault.text);
  map.Done();
  return log;
}

}  // namespace

RecorderConfig LoadRecorder(ConfigMap map) {
  RecorderConfig recorder;
  recorder.directory = map.String("directory", "");
  if (map.Has("directory") && !recorder.directory.starts_with('/')) {
    map.Error("directory", Quoted(recorder.directory) + " is no absolute path, e.g. /var/log/axlecast");
  }
  auto logs = map.Maps("logs");
  const bool stands = map.node().IsDefined() && (map.node().IsMap() || map.node().IsNull());
  if (stands && logs.empty()) {
    map.Error("logs", "is missing or empty: name at least one log, e.g. {all: {quota: 20GB}}");
  }
  if (logs.size() > kMostLogs) {
    map.Error("logs", std::to_string(logs.size()) + " logs: at most " + std::to_string(kMostLogs) +
                          ", because each hears all messages by itself");
  } else {
    for (auto& [name, log] : logs) recorder.logs.push_back(LoadLog(name, log));
  }
  map.Done();
  return recorder;
}

}  // namespace axlecast
