#pragma once

#include <CLI/CLI.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/recorder/recording_session.h"

namespace axlecast {

// Options of `axlecast record`.
struct RecordOptions {
  ConfigOption config;
  std::string file;  // or a folder; empty: the current folder, or the logs of the machine's file
  std::vector<std::string> urls;
  LogConfig log;  // its name is the name of the recorder
  double split_s = 0;
  double keep_s = 0;
  double before_s = 0;
  double after_s = 10;
  std::int64_t sync_ms = 100;
  bool append = false;
  bool json = false;

  void AddTo(CLI::App& command);
  // Returns true if the command records the logs that the machine's file defines.
  [[nodiscard]] bool UsesLogsOf(const std::optional<MachineConfig>& machine) const;
  // Returns an error if an option defines a log of its own. Only for the logs of the machine's file.
  [[nodiscard]] Result<> CheckNoLogOption() const;

 private:
  const CLI::App* command_ = nullptr;
};

// The settings of all recordings, from the options and the machine's file.
struct RecordPlan {
  std::vector<RecordingSettings> logs;  // at least one
  std::string prefix;                   // of the channels on which the health is published
  std::string folder;                   // to create and lock; empty: the folder must exist
};
[[nodiscard]] Result<RecordPlan> MakeRecordPlan(const RecordOptions& options,
                                                const std::optional<MachineConfig>& machine);

// Returns the state of a recording in one line: rate, size, losses, free space, the time until the disk is full, and closed logs that
// wait for the shipper.
[[nodiscard]] std::string RecordStatusLine(const recorder_health_t& health, const ClosedLogsStatus& closed);

// Returns the result of a recording as several lines.
[[nodiscard]] std::string RecordSummary(const RecordingStatus& status);

// Returns the JSON object of the end (docs/record.md), without a newline.
[[nodiscard]] std::string RecordEndJson(const std::string& name, const RecordingStatus& status);

// Returns the exit code (terminal.h) of a recording that has ended.
[[nodiscard]] int RecordExitCode(const RecordingStatus& status);

}  // namespace axlecast
