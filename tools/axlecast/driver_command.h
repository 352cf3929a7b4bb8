#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast driver BUS`: becomes the driver program of the bus's family.
void AddDriverCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
