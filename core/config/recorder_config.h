#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/time.h"

namespace axlecast {

class ConfigMap;

// One log of a recorder: what goes into it, how it is cut, how long it stays.
struct LogConfig {
  std::string name;
  std::string channels;          // regular expression; empty: all
  bool invert = false;           // channels that do not match
  std::int64_t split_bytes = 0;  // 0: derived from quota and keep
  MonoNs split_time = 0;         // 0: derived from keep
  std::int64_t quota_bytes = 0;  // 0: no limit
  MonoNs keep = 0;               // 0: no limit
  MonoNs sync = 100 * kMillisecond;
  std::int64_t buffer_bytes = 64 << 20;  // of messages that wait for the disk
  std::string trigger;                   // regular expression; empty: records always
  MonoNs pre_trigger = 0;
  MonoNs post_trigger = 10 * kSecond;
};

struct RecorderConfig {
  std::string directory;  // empty: see LogDirectory
  std::vector<LogConfig> logs;
};

// What is wrong with a log, and what would be right.
struct LogFault {
  const char* key;  // of docs/configuration.md
  std::string text;
};
[[nodiscard]] std::vector<LogFault> FaultsOf(const LogConfig& log);

// Return the size and the time after which a log ends (0: no limit). Both are also derived from `quota` and `keep`, because
// the log that is being written is never deleted.
[[nodiscard]] std::int64_t SplitBytes(const LogConfig& log);
[[nodiscard]] MonoNs SplitTime(const LogConfig& log);

// Reads `recorder`: the logs that are written of the machine.
[[nodiscard]] RecorderConfig LoadRecorder(ConfigMap map);

}  // namespace axlecast
