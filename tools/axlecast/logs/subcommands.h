#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Each function adds the subcommands that its comment names to `app`, or to the subcommand that its argument names.
// A subcommand stores the exit code of the process in `exit_code` when it has run.

// log and its subcommands
void AddLogCommand(CLI::App& app, int& exit_code);
// log cat
void AddLogCatCommand(CLI::App& log, int& exit_code);
// log convert (docs/convert.md)
void AddLogConvertCommand(CLI::App& log, int& exit_code);
// log filter
void AddLogFilterCommand(CLI::App& log, int& exit_code);
// log info
void AddLogInfoCommand(CLI::App& log, int& exit_code);
// log merge
void AddLogMergeCommand(CLI::App& log, int& exit_code);
// log plot (docs/convert.md)
void AddLogPlotCommand(CLI::App& log, int& exit_code);
// log repair
void AddLogRepairCommand(CLI::App& log, int& exit_code);
// log verify
void AddLogVerifyCommand(CLI::App& log, int& exit_code);
// record
void AddRecordCommand(CLI::App& app, int& exit_code);
// redecode: runs the decoders on the captured bytes of a log
void AddRedecodeCommand(CLI::App& app, int& exit_code);
// replay: sends the messages of event logs on LCM
void AddReplayCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
