#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `axlecast record`. Sets `exit_code` when it has run.
void AddRecordCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
