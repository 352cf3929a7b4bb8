#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast motor start|stop`: sets `exit_code` when it was the command.
void AddMotorCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
