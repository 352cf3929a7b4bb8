#pragma once

#include <string>
#include <vector>

namespace axlecast {

// A program run to its end, found along PATH and in /usr/sbin.
struct ProgramResult {
  std::string problem;  // why it could not be started, or how it failed with what it said; empty: exit code 0
  std::string output;   // standard output, at most 4 MiB
};
[[nodiscard]] ProgramResult RunProgram(const std::vector<std::string>& words);

// Writes a value into a file that the kernel provides: none is created. Empty when done, else why not.
[[nodiscard]] std::string WriteValue(const std::string& path, const std::string& value);

// Adds the line to a text file unless it stands there already; makes file and folder where they are missing. Empty when
// done, else why not.
[[nodiscard]] std::string AppendLine(const std::string& path, const std::string& line);

}  // namespace axlecast
