#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast report`.
void AddReportCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
