#pragma once

#include <axlecast/recorder_health_t.hpp>
#include <string>

#include "tools/recorder/recording_session.h"

namespace axlecast {

// Returns the state of a recording in one line: rate, size, losses, free space and the time until the disk is full.
[[nodiscard]] std::string RecordStatusLine(const recorder_health_t& health);

// Returns the result of a recording as several lines.
[[nodiscard]] std::string RecordSummary(const RecordingStatus& status);

// Return the JSON objects of the start and of the end (docs/record.md), without a newline.
[[nodiscard]] std::string RecordStartJson(const std::string& name, const RecordingStatus& status,
                                          const std::vector<std::string>& urls);
[[nodiscard]] std::string RecordEndJson(const std::string& name, const RecordingStatus& status);

// Returns the exit code (exit_code.h) of a recording that has ended.
[[nodiscard]] int RecordExitCode(const RecordingStatus& status);

}  // namespace axlecast
