#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast trips`: sets `exit_code` when it was the command.
void AddTripsCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
