#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `convert` to `axlecast log` (docs/convert.md). Sets `exit_code` when it has run.
void AddLogConvertCommand(CLI::App& log, int& exit_code);

}  // namespace axlecast
