#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast simulate`: runs the simulators of a machine's buses, or looks at and changes running ones.
void AddSimulateCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
