#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast param list|get|set|export|import`: sets `exit_code` when it was the command.
void AddParamCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
