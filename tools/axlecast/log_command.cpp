#include "tools/axlecast/log_command.h"

#include "tools/axlecast/log_cat_command.h"
#include "tools/axlecast/log_convert_command.h"
#include "tools/axlecast/log_filter_command.h"
#include "tools/axlecast/log_info_command.h"
#include "tools/axlecast/log_input.h"
#include "tools/axlecast/log_merge_command.h"
#include "tools/axlecast/log_plot_command.h"
#include "tools/axlecast/log_repair_command.h"
#include "tools/axlecast/log_verify_command.h"

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
