#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>

#include "tools/axlecast/logs/log_input.h"

namespace axlecast {

void AddLogCommand(CLI::App& app, int& exit_code) {
  CLI::App* log =
      app.add_subcommand("log", "LCM event logs: what they hold, whether they are sound, parts of them");
  log->require_subcommand(1);
  AddLogInfoCommand(*log, exit_code);
  AddLogCatCommand(*log, exit_code);
  AddLogFilterCommand(*log, exit_code);
  AddLogMergeCommand(*log, exit_code);
  AddLogRepairCommand(*log, exit_code);
  AddLogVerifyCommand(*log, exit_code);
  AddLogConvertCommand(*log, exit_code);
  AddLogPlotCommand(*log, exit_code);
  log->footer(
      std::string("Logs of axlecast record, of lcm-logger, and of any other program that writes LCM's format;"
                  " damaged ones too.\n") +
      kLogExitCodes);
}

}  // namespace axlecast
