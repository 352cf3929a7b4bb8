#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast log`: what can be done with event logs. Sets `exit_code` when it has run.
void AddLogCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
