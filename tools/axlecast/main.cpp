#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>

#include "core/base/result.h"
#include "platform/os/process.h"
#include "platform/os/terminal.h"
#include "tools/axlecast/cli_tree.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/decode/decode_command.h"
#include "tools/axlecast/run/mqtt_process.h"

namespace axlecast {
namespace {

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Shaft positions and motor health over LCM.\nEvery command: axlecast COMMAND --help.", "axlecast");
  app.set_version_flag("--version", "axlecast " AXLECAST_VERSION);
  app.require_subcommand(1);
  int exit_code = kExitDone;
  // In the order of --help.
  for (const auto add : {
         &AddUpCommand, &AddWatchCommand, &AddStatusCommand, &AddInfoCommand, &AddAlarmCommands, &AddDoCommands,
             &AddHomeCommand, &AddOffsetCommand, &AddPermitCommand, &AddMotorCommand, &AddTripsCommand,
             &AddParamCommand, &AddDatumCommands, &AddBackupCommands, &AddReplaceCommand, &AddHistoryCommand,
             &AddHwtestCommand, &AddReportCommand, &AddTimeCommand, &AddSetsCommand, &AddSkewCommand,
             &AddRecordCommand, &AddReplayCommand, &AddMqttCommand, &AddShipCommand, &AddFleetCommand,
             &AddLogCommand, &AddRedecodeCommand,
#if AXLECAST_WEB
             &AddWebCommand, &AddFoxgloveCommand,
#endif
             &AddScanCommand, &AddCheckConfigCommand, &AddDoctorCommand, &AddKeygenCommand, &AddSimulateCommand,
             &AddDriverCommand, &AddSpyCommand, &AddShellCommand, &AddDecodeCommand, &AddSsiPlanCommand
       }) {
    add(app, exit_code);
  }
#if !AXLECAST_WEB
  app.get_subcommand("up")->remove_option(app.get_subcommand("up")->get_option("--web"));
#endif
  app.get_subcommand("keygen")->preparse_callback([](std::size_t) {
    const auto forbidden = ForbidCoreDumps();
    if (!forbidden) static_cast<void>(std::fprintf(stderr, "warning: %s\n", forbidden.error().text.c_str()));
  });
  AddCliTreeOption(app);
  if (const auto known = CheckCommands(app, {argv + 1, argv + argc}); !known) {
    return Fail(known.error().text, kExitUsage);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitDone : kExitUsage;
  }
  return exit_code;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  static_cast<void>(signal(SIGPIPE, SIG_IGN));  // write() reports that the reader is gone
  try {
    if (argc == 2 && std::string_view(argv[1]) == axlecast::kMqttLinkOption) return axlecast::ServeMqttLink();
    const axlecast::TerminalOutput safe;
    return axlecast::RunCommandLine(argc, argv);
  } catch (const std::exception& error) {  // of the libraries: memory or a file system that fails
    static_cast<void>(std::fprintf(stderr, "axlecast: %s\n", error.what()));
    return axlecast::kExitBad;
  }
}
