#include "tools/axlecast/device_data/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <iterator>
#include <memory>

#include "core/messages/json/field.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/replace_wizard.h"
#include "tools/axlecast/live/format_device.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  ReplaceOptions replace;
  std::string from = "backup";
  bool already_exchanged = false;
};

int Replace(Options options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  ReplaceOptions& replace = options.replace;
  if (machine->BusOf(replace.command.device) == nullptr)
    return Fail(UnknownDevice(*machine, replace.command.device), kExitUsage);
  if (!replace.command.yes && !CanAsk("replace")) return kExitUsage;
  if (options.already_exchanged) options.from = "accept";
  const auto step = std::find(std::begin(kReplaceSteps), std::end(kReplaceSteps), options.from);
  replace.from = static_cast<ReplaceStep>(std::distance(std::begin(kReplaceSteps), step));
  ReplaceWizard wizard(*machine, replace);
  const int exit_code = wizard.Run();
  Show(ToJson(wizard.report()), ToText(wizard.report()), replace.command.json);
  return exit_code;
}

void AddOptions(CLI::App& command, Options& options) {
  ReplaceOptions& replace = options.replace;
  command.add_option("DEVICE", replace.command.device, "The device")->required();
  command
      .add_option("--backup", replace.backup,
                  "File of the backup: used if it exists, else written; default DEVICE-UTC.txt in this folder")
      ->type_name("FILE");
  command.add_option("--value", replace.value, "Value of the axis after the exchange, in its unit")
      ->check(PlainNumber())
      ->type_name("V");
  CLI::Option* from =
      command.add_option("--from", options.from, "Start at this step")
          ->check(CLI::IsMember(std::vector<std::string>(std::begin(kReplaceSteps), std::end(kReplaceSteps))))
          ->type_name("STEP");
  command
      .add_flag("--already-exchanged", options.already_exchanged,
                "The device was already exchanged: same as --from accept, with the file of --backup if given")
      ->excludes(from);
  options.config.AddTo(command, ConfigOption::Form::kOptionOnly);
  AddKeyOption(command, replace.command.key);
  command.add_flag("--yes", replace.command.yes, "Do not ask; without --value, no datum is set");
  command.add_flag("--json", replace.command.json, "Print the result as one JSON object");
  AddReasonOption(command, replace.command.reason);
}

}  // namespace

void AddReplaceCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("replace", "Exchange a device step by step: backup, exchange, accept, write back, datum");
  AddOptions(*command, *options);
  command->footer(
      std::string(
          "examples:\n"
          "  axlecast replace axis1\n"
          "  axlecast replace axis1 --already-exchanged --backup axis1-20261121T070005Z.txt\n"
          "  axlecast replace axis1 --from datum\n"
          "  axlecast replace axis1 --yes --value 12.5 --json\n"
          "steps: backup, exchange, accept, write, datum; each can be repeated. Ctrl-C stops and prints the\n"
          "state and the command to continue.\n") +
      kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Replace(*options); });
}

}  // namespace axlecast
