#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `axlecast offset capture`. It sets `exit_code` when it has run.
void AddOffsetCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
