#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast log filter`.
void AddLogFilterCommand(CLI::App& log, int& exit_code);

}  // namespace axlecast
