#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast mqtt`.
void AddMqttCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
