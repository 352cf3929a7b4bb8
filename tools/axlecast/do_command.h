#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast do` and its aliases by effect: zero, reset-turns, clear-errors, eeprom read|write|backup.
void AddDoCommands(CLI::App& app, int& exit_code);

}  // namespace axlecast
