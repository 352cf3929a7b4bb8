#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// Adds `axlecast home`: the software datum. It sets `exit_code` when it has run.
void AddHomeCommand(CLI::App& app, int& exit_code);

// Adds `undo` to `axlecast datum`.
void AddDatumUndo(CLI::App& datum, int& exit_code);

}  // namespace axlecast
