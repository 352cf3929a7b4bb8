#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Each function adds the subcommands that its comment names to `app`, or to the subcommand that its argument names.
// A subcommand stores the exit code of the process in `exit_code` when it has run.

// alarms, ack, shelve, unshelve
void AddAlarmCommands(CLI::App& app, int& exit_code);
// shelve, unshelve
void AddShelvingCommands(CLI::App& app, int& exit_code);
// datum and its subcommands
void AddDatumCommands(CLI::App& app, int& exit_code);
// do, and its aliases zero, reset-turns, clear-errors, eeprom
void AddDoCommands(CLI::App& app, int& exit_code);
// history: reads the journal of the bridge
void AddHistoryCommand(CLI::App& app, int& exit_code);
// home: sets the software datum
void AddHomeCommand(CLI::App& app, int& exit_code);
// datum undo
void AddDatumUndo(CLI::App& datum, int& exit_code);
// motor start|stop
void AddMotorCommand(CLI::App& app, int& exit_code);
// offset capture
void AddOffsetCommand(CLI::App& app, int& exit_code);
// permit
void AddPermitCommand(CLI::App& app, int& exit_code);
// trips
void AddTripsCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
