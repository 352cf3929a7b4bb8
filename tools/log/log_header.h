#pragma once

#include <string_view>

namespace axlecast {

// What a recorded log begins with, so that it can be read without anything else: events on these channels, before all
// others, in every file that a recording is split into.
inline constexpr std::string_view kMachineChannel = "AXLECAST/machine.yaml";  // the machine's file, as text
// All of lcmtypes/*.lcm as one text, files in order.
inline constexpr std::string_view kSchemaChannel = "AXLECAST/schema";
// JSON: version, host, URLs, start, the file's number.
inline constexpr std::string_view kRecorderChannel = "AXLECAST/recorder";

// True of the channels that axlecast's own logs hold beside what was heard: the above, and the seal.
[[nodiscard]] bool IsLogChannel(std::string_view channel);

}  // namespace axlecast
