#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast log info`.
void AddLogInfoCommand(CLI::App& log, int& exit_code);

}  // namespace axlecast
