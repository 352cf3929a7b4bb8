#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast check-config`: reads the machine's file as every process does and tells what it means.
void AddCheckConfigCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
