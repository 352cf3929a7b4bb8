#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace axlecast {

// What every log of a recording begins with (tools/log/log_header.h).
struct LogIdentity {
  std::string name;  // of the recorder
  std::string host;
  std::string machine;  // the machine's file as text; empty: there is none
  std::vector<std::string> urls;
  std::string channel;  // --channel; empty: all
  bool invert = false;
};

// Channel and content of each header event of the recording's log `number` (from 0), which begins at `utime` (us, UNIX).
[[nodiscard]] std::vector<std::pair<std::string, std::string>> HeaderEvents(const LogIdentity& identity,
                                                                            std::int64_t utime,
                                                                            std::int64_t number);

// All of lcmtypes/*.lcm, each behind a line "// <file>".
[[nodiscard]] const std::string& SchemaText();

}  // namespace axlecast
