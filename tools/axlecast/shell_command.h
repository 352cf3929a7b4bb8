#pragma once

#include <CLI/App.hpp>

namespace axlecast {

void AddShellCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
