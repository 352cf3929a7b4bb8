#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Each function adds the subcommands that its comment names to `app`, or to the subcommand that its argument names.
// A subcommand stores the exit code of the process in `exit_code` when it has run. The folder of the same name implements
// the functions below its heading.

// ---- live ----

// spy: runs lcm-spy on the LCM URL of the machine, with the message types of axlecast
void AddSpyCommand(CLI::App& app, int& exit_code);
void AddStatusCommand(CLI::App& app, int& exit_code);  // status: the state of the machine
void AddInfoCommand(CLI::App& app, int& exit_code);    // info: the state of one device
void AddWatchCommand(CLI::App& app, int& exit_code);   // watch: the messages of the machine as they arrive

// ---- logs ----

void AddLogCommand(CLI::App& app, int& exit_code);  // log and its subcommands
void AddLogCatCommand(CLI::App& log, int& exit_code);
void AddLogConvertCommand(CLI::App& log, int& exit_code);
void AddLogFilterCommand(CLI::App& log, int& exit_code);
void AddLogInfoCommand(CLI::App& log, int& exit_code);
void AddLogMergeCommand(CLI::App& log, int& exit_code);
void AddLogPlotCommand(CLI::App& log, int& exit_code);
void AddLogRepairCommand(CLI::App& log, int& exit_code);
void AddLogVerifyCommand(CLI::App& log, int& exit_code);
void AddRecordCommand(CLI::App& app, int& exit_code);
void AddRedecodeCommand(CLI::App& app, int& exit_code);
void AddReplayCommand(CLI::App& app, int& exit_code);

// ---- command ----

void AddAlarmCommands(CLI::App& app, int& exit_code);     // alarms, ack, shelve, unshelve
void AddShelvingCommands(CLI::App& app, int& exit_code);  // shelve, unshelve
void AddDatumCommands(CLI::App& app, int& exit_code);     // datum and its subcommands
void AddDoCommands(CLI::App& app, int& exit_code);  // do, and its aliases zero, reset-turns, clear-errors, eeprom
void AddHistoryCommand(CLI::App& app, int& exit_code);  // history: reads the journal of the bridge
void AddHomeCommand(CLI::App& app, int& exit_code);     // home: sets the software datum
void AddDatumUndo(CLI::App& datum, int& exit_code);
void AddMotorCommand(CLI::App& app, int& exit_code);  // motor start|stop
void AddOffsetCommand(CLI::App& app, int& exit_code);
void AddPermitCommand(CLI::App& app, int& exit_code);
void AddTripsCommand(CLI::App& app, int& exit_code);

// ---- run ----

// driver BUS: replaces this process by the driver program of the family of the bus
void AddDriverCommand(CLI::App& app, int& exit_code);
void AddMqttCommand(CLI::App& app, int& exit_code);
void AddShellCommand(CLI::App& app, int& exit_code);
// simulate: runs the simulators of the buses of a machine, or queries and changes running ones
void AddSimulateCommand(CLI::App& app, int& exit_code);
void AddSetsCommand(CLI::App& app, int& exit_code);      // sets: publishes several axes on one tick
void AddSkewCommand(CLI::App& app, int& exit_code);      // skew: how far apart they are sampled
void AddTimeCommand(CLI::App& app, int& exit_code);      // time: keeps the time base of the machine
void AddUpCommand(CLI::App& app, int& exit_code);        // up: runs the whole machine in the foreground
void AddWebCommand(CLI::App& app, int& exit_code);       // web; only in a build with AXLECAST_WEB
void AddFoxgloveCommand(CLI::App& app, int& exit_code);  // foxglove; only in a build with AXLECAST_WEB

// ---- fleet ----

void AddFleetCommand(CLI::App& app, int& exit_code);        // fleet and its subcommands
void AddFleetInitCommand(CLI::App& fleet, int& exit_code);  // fleet init: creates or migrates the tables
void AddShipCommand(CLI::App& app, int& exit_code);         // ship: writes the recorder's logs to the database
void AddFleetUpCommand(CLI::App& fleet, int& exit_code);    // fleet up: runs a PostgreSQL in the foreground
void AddFleetStatusCommand(CLI::App& fleet, int& exit_code);
void AddFleetQueryCommand(CLI::App& fleet, int& exit_code);
void AddFleetFetchCommand(CLI::App& fleet, int& exit_code);
void AddFleetVerifyCommand(CLI::App& fleet, int& exit_code);
void AddFleetAdminCommands(CLI::App& fleet, int& exit_code);  // rename, adopt, shard, retention, expire

// ---- device_data ----

void AddBackupCommands(CLI::App& app, int& exit_code);  // backup, restore
void AddParamCommand(CLI::App& app, int& exit_code);    // param list|get|set|export|import
void AddReplaceCommand(CLI::App& app, int& exit_code);  // replace: the guided exchange of a device

// ---- setup ----

// check-config: reads the machine file as every process does, and reports the result
void AddCheckConfigCommand(CLI::App& app, int& exit_code);
void AddDoctorCommand(CLI::App& app, int& exit_code);  // doctor: checks this host, and prints the lines that fix it
void AddHwtestCommand(CLI::App& app, int& exit_code);
// keygen: creates signing keys. Its process must not write a core file
void AddKeygenCommand(CLI::App& app, int& exit_code);
void AddReportCommand(CLI::App& app, int& exit_code);
void AddScanCommand(CLI::App& app, int& exit_code);
// ssi-plan: calculates the clock that a cable allows (docs/cli.md)
void AddSsiPlanCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
