#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/config/machine_config.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/recorder/recording_session.h"

namespace axlecast {

// What `axlecast record` was asked for.
struct RecordOptions {
  ConfigOption config;
  std::string file;  // or a folder; empty: the current one, or the logs of the machine's file
  std::vector<std::string> urls;
  LogConfig log;  // its name: of the recorder
  double split_s = 0;
  double keep_s = 0;
  double before_s = 0;
  double after_s = 10;
  std::int64_t sync_ms = 100;
  bool append = false;
  bool json = false;

  void AddTo(CLI::App& command);
  // Whether the logs are those that the machine's file names.
  [[nodiscard]] bool MeansLogsOf(const std::optional<MachineConfig>& machine) const;
  // Why it cannot be these, because an option says what a log is to be; empty: it can.
  [[nodiscard]] std::string ShapesLog() const;

 private:
  const CLI::App* command_ = nullptr;
};

// What the recordings need, out of the options and the machine's file.
struct RecordPlan {
  std::vector<RecordingSettings> logs;  // at least one, unless there is a problem
  std::string prefix;                   // of the channels of their health
  std::string folder;                   // to be made when it is missing; empty: it must be there
  std::string problem;                  // why the options cannot be used, and what would be right; empty: they can
};
[[nodiscard]] RecordPlan MakeRecordPlan(const RecordOptions& options, const std::optional<MachineConfig>& machine);

}  // namespace axlecast
