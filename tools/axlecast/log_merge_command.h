#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast log merge`.
void AddLogMergeCommand(CLI::App& log, int& exit_code);

}  // namespace axlecast
