#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `axlecast replace`: the guided exchange of a device. It sets `exit_code` when it has run.
void AddReplaceCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
