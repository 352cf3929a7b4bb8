#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast watch`: the machine's messages as they come.
void AddWatchCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
