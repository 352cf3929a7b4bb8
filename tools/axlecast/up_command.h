#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast up`: the whole machine in the foreground.
void AddUpCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
