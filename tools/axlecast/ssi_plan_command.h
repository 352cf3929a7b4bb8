#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast ssi-plan` (docs/cli.md): which clock a cable allows.
void AddSsiPlanCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
