#pragma once

#include <CLI/CLI.hpp>
#include <iosfwd>
#include <string>
#include <vector>

namespace axlecast {

// `axlecast decode` (docs/decode.md), for every family that was built.
void AddDecodeCommand(CLI::App& app, int& exit_code);

struct DecodeArguments {
  std::string protocol;
  std::vector<std::string> settings;  // key=value
  std::vector<std::string> frames;    // none: one frame a line from `in`
  bool bits = false;                  // frames are written as bits
};

// One JSON object per frame to `out`, what is wrong with the call to `err`. Returns the exit code.
[[nodiscard]] int RunDecode(const DecodeArguments& arguments, std::istream& in, std::ostream& out,
                            std::ostream& err);

}  // namespace axlecast
