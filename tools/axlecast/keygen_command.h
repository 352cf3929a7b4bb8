#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast keygen`: makes signing keys, and says what of them belongs into the machine's file. Its process must leave no
// core file.
void AddKeygenCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
