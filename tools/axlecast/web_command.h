#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// axlecast web
void AddWebCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
