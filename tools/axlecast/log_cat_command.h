#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast log cat`.
void AddLogCatCommand(CLI::App& log, int& exit_code);

}  // namespace axlecast
