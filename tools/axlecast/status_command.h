#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast status` (the machine) and `axlecast info` (one device).
void AddStatusCommand(CLI::App& app, int& exit_code);
void AddInfoCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
