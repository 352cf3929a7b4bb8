#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/runtime/config/machine_config.h"
#include "tools/axlecast/config_option.h"
#include "tools/recorder/recording.h"

namespace axlecast {

// What `axlecast record` was asked for.
struct RecordOptions {
  ConfigOption config;
  std::string file;  // or a folder; empty: the current one
  std::vector<std::string> urls;
  std::string channel;
  std::string name;
  std::string trigger;
  std::uint64_t split_bytes = 0;
  std::uint64_t quota_bytes = 0;
  std::uint64_t queue_bytes = 64U << 20;
  double split_s = 0;
  double before_s = 0;
  double after_s = 10;
  std::int64_t sync_ms = 100;
  bool invert = false;
  bool append = false;
  bool json = false;

  void AddTo(CLI::App& command);
};

// What a recording needs, out of the options and the machine's file.
struct RecordPlan {
  RecordingSettings settings;
  std::string prefix;   // of the channel of its health
  std::string problem;  // why the options cannot be used, and what would be right; empty: they can
};
[[nodiscard]] RecordPlan MakeRecordPlan(const RecordOptions& options, const std::optional<MachineConfig>& machine);

}  // namespace axlecast
