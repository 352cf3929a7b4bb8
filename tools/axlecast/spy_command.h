#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast spy`: lcm-spy on the machine's URL, with our types.
void AddSpyCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
