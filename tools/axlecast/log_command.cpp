#include "tools/axlecast/log_command.h"

#include "tools/axlecast/log_convert_command.h"
#include "tools/axlecast/log_plot_command.h"

namespace axlecast {

void AddLogCommand(CLI::App& app, int& exit_code) {
  CLI::App* log = app.add_subcommand("log", "Event logs: convert, plot");
  log->require_subcommand(1);
  AddLogConvertCommand(*log, exit_code);
  AddLogPlotCommand(*log, exit_code);
}

}  // namespace axlecast
