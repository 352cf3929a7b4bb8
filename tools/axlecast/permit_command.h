#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `axlecast permit`. It sets `exit_code` when it has run.
void AddPermitCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
