#include "tools/axlecast/setup/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "core/config/load.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/setup/config_report.h"

namespace axlecast {
namespace {

struct CheckOptions {
  ConfigOption config;
  bool json = false;
  std::string list;
  bool keys = false;
};

// The keys under `simulate` are the family's: building the simulator is what checks them.
void CheckSimulators(const MachineConfig& machine, ConfigErrors& errors) {
  SimulatorMaker maker(machine, errors);
  for (const BusConfig& bus : machine.buses) {
    if (bus.simulate) static_cast<void>(maker.Make(bus));
  }
}

// One name a line, for scripts: completion and the generator of systemd units read it.
std::string Names(const MachineConfig& machine, const std::string& list) {
  std::string lines;
  for (const std::string& name :
       list == "units" ? MachineUnits(machine) : MachineNames(machine, list == "devices")) {
    lines += name + '\n';
  }
  return lines;
}

int CheckConfig(const CheckOptions& options) {
  const std::string file = options.config.File();
  if (file.empty()) return options.config.Fail(options.config.Load().error());
  ConfigErrors errors(file);
  const std::optional<MachineConfig> machine = LoadConfig(file, errors);
  if (machine) CheckSimulators(*machine, errors);
  const bool good = machine && errors.empty();
  if (good && !options.list.empty()) {
    std::cout << Names(*machine, options.list);
  } else if (good && options.keys) {
    std::cout << (options.json ? ConfigKeysJson(errors.keys()).dump() + '\n' : ConfigKeysText(errors.keys()));
  } else if (options.json) {
    const auto json = ConfigJson(file, good ? &*machine : nullptr, errors);
    std::cout << json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
  } else if (good) {
    std::cout << file << ": good\n" << ConfigText(*machine);
    for (const std::string& warning : ConfigWarnings(*machine)) std::cout << "warning: " << warning << '\n';
  } else {
    const std::size_t count = errors.list().size();
    std::cerr << errors.Text() << file << ": " << count << (count == 1 ? " error\n" : " errors\n");
  }
  return good ? kExitDone : kExitBad;
}

}  // namespace

void AddCheckConfigCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand(
      "check-config",
      "Checks a machine's file; prints refresh times, how busy each bus will be, and who may command");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  CLI::Option* list =
      command
          ->add_option("--list", options->list,
                       "Only these names, one a line; units: of systemd, which the machine consists of")
          ->check(CLI::IsMember({"buses", "devices", "units"}));
  command->add_flag("--json", options->json, "One JSON object: file, ok, errors, warnings, machine, buses, bridge")
      ->excludes(list);
  command
      ->add_flag("--keys", options->keys,
                 "Lists every key that such a file may have, with its range and default, in place of the report")
      ->excludes(list);
  command->footer(
      "examples:\n"
      "  axlecast check-config config/demo.yaml\n"
      "  axlecast check-config --keys drivers/ssi/example.yaml | grep simulate\n"
      "  axlecast check-config --json machine.yaml | jq '.errors[].text'\n"
      "  axlecast check-config --list devices\n"
      "Exit code 0: good (warnings or none), 1: errors. Every key: docs/configuration.md");
  command->callback([options, &exit_code] { exit_code = CheckConfig(*options); });
}

}  // namespace axlecast
