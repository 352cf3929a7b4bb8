#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Each function adds the subcommands that its comment names to `app`, or to the subcommand that its argument names.
// A subcommand stores the exit code of the process in `exit_code` when it has run.

// log and its subcommands (docs/log.md, docs/convert.md)
void AddLogCommand(CLI::App& app, int& exit_code);
void AddLogCatCommand(CLI::App& log, int& exit_code);
void AddLogConvertCommand(CLI::App& log, int& exit_code);
void AddLogFilterCommand(CLI::App& log, int& exit_code);
void AddLogInfoCommand(CLI::App& log, int& exit_code);
void AddLogMergeCommand(CLI::App& log, int& exit_code);
void AddLogPlotCommand(CLI::App& log, int& exit_code);
void AddLogRepairCommand(CLI::App& log, int& exit_code);
void AddLogVerifyCommand(CLI::App& log, int& exit_code);

// record
void AddRecordCommand(CLI::App& app, int& exit_code);
// redecode: runs the decoders on the captured bytes of a log
void AddRedecodeCommand(CLI::App& app, int& exit_code);
// replay: sends the messages of event logs on LCM
void AddReplayCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
