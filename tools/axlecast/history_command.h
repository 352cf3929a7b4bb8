#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `axlecast history`, which reads the bridge's journal. Sets `exit_code` when it has run.
void AddHistoryCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
