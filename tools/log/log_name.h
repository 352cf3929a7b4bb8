#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// Generated names of logs: NAME_YYYYMMDDTHHMMSSZ.lcm (UTC). If several logs begin in one second, _001, _002, ... precede the
// extension. A closed log may be compressed: NAME_YYYYMMDDTHHMMSSZ.lcm.zst.

inline constexpr std::string_view kCompressedEnding = ".zst";  // follows the name of the log

// Returns the suffix of a further file of the same name: "_007"; no text for 0.
[[nodiscard]] std::string CopySuffix(int copy);

// Returns the generated name. `copy`: 0 for the name without a number.
[[nodiscard]] std::string LogFileName(std::string_view name, std::int64_t utime, int copy);

// Returns the start of the log with this file name, compressed or not (us, UNIX time), or nothing if the recorder did not
// generate the name.
[[nodiscard]] std::optional<std::int64_t> LogFileBegin(std::string_view name, std::string_view file);

// Returns the part of a generated name before the time; no text if the recorder did not generate the name.
[[nodiscard]] std::string_view LogFilePrefix(std::string_view file);

// Returns the name that the log has or had before it was compressed: without ".zst". It identifies the log in its folder.
[[nodiscard]] std::string_view PlainLogName(std::string_view file);

// Returns true if the folder contains the log, compressed or not. `file`: PlainLogName. An error, such as a missing right,
// counts as true.
[[nodiscard]] bool LogExists(const std::string& folder, std::string_view file);

}  // namespace axlecast
