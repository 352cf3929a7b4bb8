#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast log verify`.
void AddLogVerifyCommand(CLI::App& log, int& exit_code);

}  // namespace axlecast
