#include "core/config/load_recorder.h"

#include "core/base/words.h"

namespace axlecast {
namespace {

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
