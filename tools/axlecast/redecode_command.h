#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `axlecast redecode`: the drivers' code over the captured bytes of a log. Sets `exit_code` when it has run.
void AddRedecodeCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
