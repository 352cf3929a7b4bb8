#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// `axlecast doctor`: what on this host stands in the way of a machine, and the lines that mend it.
void AddDoctorCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
