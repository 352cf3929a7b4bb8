#include "drivers/runtime/process/driver_main.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "core/config/load.h"
#include "platform/os/terminal.h"

namespace axlecast {
namespace {

constexpr int kBadConfig = 1;
constexpr int kUsage = 2;

}  // namespace

int DriverMain(const Family& family, int argc, char** argv, const DriverInterposers& interposers) {
  const TerminalOutput safe;
  std::string config;
  std::string bus_name;
  bool verbose = false;
  CLI::App app{"Driver for one bus of family " + std::string(family.name) + ": " + std::string(family.summary)};
  app.footer("Example: " + std::string(argv[0]) + " --config machine.yaml --bus rs485-0\n" +
             "Runs until SIGTERM or SIGINT. Exit codes: 0 clean stop, 1 configuration or LCM, 2 usage.");
  app.set_version_flag("--version", AXLECAST_VERSION);
  app.add_option("--config", config, "The machine's file")->required();
  app.add_option("--bus", bus_name, "Name of the bus in that file")->required();
  app.add_flag("--verbose", verbose, "Log more");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }

  ConfigErrors errors(config);
  const auto machine = LoadConfig(config, errors, bus_name);
  if (!machine) {
    std::cerr << errors.Text();
    return kBadConfig;
  }
  const BusConfig* bus = machine->FindBus(bus_name);
  if (bus == nullptr || bus->family != &family) {
    std::cerr << config << ": bus " << bus_name << " is not of family " << family.name
              << ": start its own driver, or `axlecast driver " << bus_name << "`\n";
    return kBadConfig;
  }
  return RunDriver(*machine, *bus, verbose, interposers);
}

}  // namespace axlecast
