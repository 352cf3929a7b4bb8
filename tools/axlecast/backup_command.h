#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// axlecast backup, restore
void AddBackupCommands(CLI::App& app, int& exit_code);

}  // namespace axlecast
