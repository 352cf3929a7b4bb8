#pragma once

#include <CLI/App.hpp>

namespace axlecast {

// axlecast alarms, ack, shelve, unshelve
void AddAlarmCommands(CLI::App& app, int& exit_code);

}  // namespace axlecast
