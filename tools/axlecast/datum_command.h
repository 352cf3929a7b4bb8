#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `axlecast datum` and its subcommands. They set `exit_code` when they have run.
void AddDatumCommands(CLI::App& app, int& exit_code);

}  // namespace axlecast
