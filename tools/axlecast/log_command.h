#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast log`.
void AddLogCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
