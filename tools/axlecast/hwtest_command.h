#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast hwtest`.
void AddHwtestCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
