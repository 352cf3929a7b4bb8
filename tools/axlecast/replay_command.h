#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast replay`: plays event logs on LCM.
void AddReplayCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
