#include "tools/axlecast/run/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "core/base/spelling.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/program.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  std::string bus;
};

int RunDriver(const Options& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const BusConfig* bus = machine->FindBus(options.bus);
  if (bus == nullptr) {
    std::vector<std::string> names;
    for (const BusConfig& candidate : machine->buses) names.push_back(candidate.name);
    std::cerr << "no bus " << Quoted(options.bus) << " in " << machine->file << "\nbuses: " << Listed(names)
              << '\n';
    return kExitUsage;
  }
  std::cerr
      << Become({DriverProgram(bus->family->name), "--config", options.config.File(), "--bus", bus->name}).text
      << '\n';
  return kExitBad;
}

}  // namespace

void AddDriverCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("driver", "Runs the driver of one bus, in the foreground");
  command->add_option("BUS", options->bus, "The bus, as in the machine's file")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->footer("example: axlecast driver rs485-0 --config machine.yaml");
  command->callback([options, &exit_code] { exit_code = RunDriver(*options); });
}

}  // namespace axlecast
