#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast log repair`.
void AddLogRepairCommand(CLI::App& log, int& exit_code);

}  // namespace axlecast
