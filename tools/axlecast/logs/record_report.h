#pragma once

#include <axlecast/recorder_health_t.hpp>
#include <string>

#include "tools/recorder/recording_session.h"

namespace axlecast {

// How a recording stands, in one line: rate, size, losses, room on the disk and for how long.
[[nodiscard]] std::string RecordStatusLine(const recorder_health_t& health);

// What a recording came to: several lines for people.
[[nodiscard]] std::string RecordSummary(const RecordingStatus& status);

// One object without a newline (docs/record.md): at the start and at the end.
[[nodiscard]] std::string RecordStartJson(const std::string& name, const RecordingStatus& status,
                                          const std::vector<std::string>& urls);
[[nodiscard]] std::string RecordEndJson(const std::string& name, const RecordingStatus& status);

// Exit code (exit_code.h) of a recording that has ended.
[[nodiscard]] int RecordExitCode(const RecordingStatus& status);

[[nodiscard]] std::string ByteText(double bytes);  // "12.3 MB"

}  // namespace axlecast
