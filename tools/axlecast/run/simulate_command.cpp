#include "core/base/result.h"
#include "tools/axlecast/run/subcommands.h"

#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/config/load.h"
#include "platform/os/folder.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/run/simulation_server.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

struct SimulateOptions {
  ConfigOption config;
  std::vector<std::string> buses;
  std::vector<std::string> changes;
  std::string interface;
  bool show = false;
  bool json = false;
  bool unplug = false;
  bool plug = false;
};

std::string Place(const MachineConfig& machine, const BusConfig& bus, const char* suffix) {
  return RunDirectory(machine.machine) + '/' + bus.name + suffix;
}

// The buses that were named, or all simulated ones. Empty when one cannot be simulated; says why.
std::vector<const BusConfig*> SimulatedBuses(const MachineConfig& machine, const std::vector<std::string>& names) {
  std::vector<const BusConfig*> buses;
  if (names.empty()) {
    for (const BusConfig& bus : machine.buses) {
      if (bus.simulate) buses.push_back(&bus);
    }
    if (buses.empty()) std::cerr << machine.file << ": no bus has `simulate: true`\n";
    return buses;
  }
  for (const std::string& name : names) {
    const BusConfig* bus = machine.FindBus(name);
    if (bus == nullptr || !bus->simulate) {
      std::cerr << machine.file << ": " << (bus == nullptr ? "no bus '" : "no `simulate: true` at bus '") << name
                << "'\n";
      return {};
    }
    buses.push_back(bus);
  }
  return buses;
}

// ---- running ----

SimulationServer* signalled = nullptr;  // what SIGTERM and SIGINT stop

void StopOnSignals(SimulationServer& server) {
  signalled = &server;
  struct sigaction action {};
  action.sa_handler = [](int) { signalled->Stop(); };
  for (const int number : {SIGTERM, SIGINT}) static_cast<void>(sigaction(number, &action, nullptr));
}

std::string AddBus(SimulationServer& server, const MachineConfig& machine, const BusConfig& bus,
                   SimulatorMaker& maker, const ConfigErrors& errors, const std::string& interface) {
  std::unique_ptr<Simulator> simulator = maker.Make(bus);
  if (!simulator) return errors.Text();
  SimulationServer::BusPlace place{.bus = bus.name,
                                   .devices = {},
                                   .link = bus.family->link,
                                   .port = bus.link.port,
                                   .control = Place(machine, bus, ".ctl"),
                                   .lock = Place(machine, bus, ".sim"),
                                   .interface = interface};
  if (bus.family_bus && !bus.family_bus->lines.empty()) place.lines = Place(machine, bus, ".lines");
  for (const DeviceConfig& device : bus.devices) place.devices.push_back(device.name);
  return server.Add(std::move(place), std::move(simulator));
}

// Nodes on a real interface are those of one CAN bus. Says why when the choice makes no sense.
bool FitsInterface(const std::vector<const BusConfig*>& buses, const std::string& interface) {
  if (interface.empty()) return true;
  if (buses.size() > 1) {
    std::cerr << "--on " << interface << ": an interface stands for one bus; name it with --bus\n";
  } else if (buses[0]->family->link != LinkKind::kCan) {
    std::cerr << "--on " << interface << ": bus " << buses[0]->name << " is no CAN bus\n";
  } else {
    return true;
  }
  return false;
}

int RunSimulators(const MachineConfig& machine, const std::vector<const BusConfig*>& buses,
                  const std::string& interface) {
  const SystemClock clock;
  SimulationServer server(clock);
  StopOnSignals(server);
  std::string problem = ErrorText(PrepareRunDirectory(RunDirectory(machine.machine)));
  ConfigErrors errors(machine.file);
  SimulatorMaker maker(machine, errors);
  for (const BusConfig* bus : buses) {
    if (problem.empty()) problem = AddBus(server, machine, *bus, maker, errors, interface);
    if (!problem.empty()) break;
    std::cout << "simulating bus " << bus->name << " on " << (interface.empty() ? bus->link.port : interface)
              << std::endl;
  }
  if (problem.empty()) problem = server.Run();
  if (problem.empty()) return kExitDone;
  std::cerr << problem << '\n';
  return kExitBad;
}

// ---- looking at and changing what runs ----

std::optional<Json> Ask(const MachineConfig& machine, const BusConfig& bus, const Json& question) {
  Json answer = Json::parse(AskControlSocket(Place(machine, bus, ".ctl"), question.dump()), nullptr, false);
  if (answer.is_object()) return answer;
  std::cerr << "no simulator runs for bus " << bus.name << ": start it with `axlecast simulate " << machine.file
            << " --bus " << bus.name << "`\n";
  return std::nullopt;
}

int Show(const MachineConfig& machine, const std::vector<const BusConfig*>& buses, bool json) {
  for (const BusConfig* bus : buses) {
    const std::optional<Json> state = Ask(machine, *bus, {{"show", true}});
    if (!state) return kExitNoAnswer;
    if (json) {
      std::cout << state->dump() << '\n';
      continue;
    }
    std::cout << bus->name << "  " << state->value("port", "") << "  "
              << (!state->value("plugged", true) ? "unplugged"
                  : state->value("host", false)  ? "host"
                                                 : "no host")
              << '\n';
    for (const auto& [device, quantities] : (*state)["devices"].items()) {
      for (const auto& [name, value] : quantities.items()) {
        std::cout << "  " << device << '.' << name << " = "
                  << (value.is_string() ? value.get<std::string>() : value.dump()) << '\n';
      }
    }
  }
  return kExitDone;
}

// "axis1.speed_rpm=300" as device, key and value.
std::optional<Json> ParseChange(const std::string& text) {
  const std::size_t dot = text.find('.');
  const std::size_t equals = text.find('=');
  if (dot == 0 || equals == std::string::npos || dot + 1 >= equals) return std::nullopt;
  return Json::array({text.substr(0, dot), text.substr(dot + 1, equals - dot - 1), text.substr(equals + 1)});
}

// The changes of each bus; nothing when one makes no sense, after saying why.
std::optional<std::map<const BusConfig*, Json>> SortChanges(const MachineConfig& machine,
                                                            const std::vector<std::string>& changes) {
  std::map<const BusConfig*, Json> sorted;
  for (const std::string& text : changes) {
    const std::optional<Json> change = ParseChange(text);
    if (!change) {
      std::cerr << "'" << text << "' is not DEVICE.KEY=VALUE, e.g. axis1.speed_rpm=300\n";
      return std::nullopt;
    }
    const std::string device = (*change)[0];
    const BusConfig* bus = machine.BusOf(device);
    if (bus == nullptr || !bus->simulate) {
      std::cerr << machine.file << ": no simulated device '" << device << "'\n";
      return std::nullopt;
    }
    sorted[bus]["set"].push_back(*change);
  }
  return sorted;
}

int Change(const MachineConfig& machine, const BusConfig& bus, const Json& question) {
  const std::optional<Json> answer = Ask(machine, bus, question);
  if (!answer) return kExitNoAnswer;
  const Json errors = answer->value("errors", Json::array());
  for (const Json& error : errors)
    std::cerr << (error.is_string() ? error.get<std::string>() : error.dump()) << '\n';
  return errors.empty() ? kExitDone : kExitBad;
}

int ChangeAll(const MachineConfig& machine, const SimulateOptions& options) {
  std::optional<std::map<const BusConfig*, Json>> questions = SortChanges(machine, options.changes);
  if (!questions) return kExitUsage;
  if (options.plug || options.unplug) {
    const std::vector<const BusConfig*> buses = SimulatedBuses(machine, options.buses);
    if (buses.empty()) return kExitUsage;
    for (const BusConfig* bus : buses) (*questions)[bus]["plugged"] = options.plug;
  }
  int worst = kExitDone;
  for (const auto& [bus, question] : *questions) worst = std::max(worst, Change(machine, *bus, question));
  return worst;
}

int Simulate(const SimulateOptions& options) {
  const Result<MachineConfig> machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const bool changing = !options.changes.empty() || options.plug || options.unplug;
  const int exit_code = changing ? ChangeAll(*machine, options) : kExitDone;
  if (exit_code != kExitDone || (changing && !options.show)) return exit_code;
  const std::vector<const BusConfig*> buses = SimulatedBuses(*machine, options.buses);
  if (buses.empty()) return kExitUsage;
  if (options.show) return Show(*machine, buses, options.json);
  if (!FitsInterface(buses, options.interface)) return kExitUsage;
  return RunSimulators(*machine, buses, options.interface);
}

}  // namespace

void AddSimulateCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App* command =
      app.add_subcommand("simulate", "Runs the simulators of a machine's buses, or changes running ones");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_option("--bus", options->buses, "Only this bus (may be repeated); all simulated ones otherwise")
      ->type_name("NAME")
      ->allow_extra_args(false);
  CLI::Option* on = command
                        ->add_option("--on", options->interface,
                                     "The nodes of one CAN bus stand on this interface of the machine instead of "
                                     "a simulated bus")
                        ->type_name("IFACE");
  command->add_option("--set", options->changes, "Changes a running simulator (may be repeated)")
      ->type_name("DEVICE.KEY=VALUE")
      ->allow_extra_args(false)
      ->excludes(on);
  command->add_flag("--show", options->show, "Prints what running simulators do and what was done to them")
      ->excludes(on);
  command->add_flag("--json", options->json, "With --show: one JSON object per bus")->needs("--show");
  CLI::Option* unplug =
      command->add_flag("--unplug", options->unplug, "Takes a running simulator's port away")->excludes(on);
  command->add_flag("--plug", options->plug, "Brings the port back")->excludes(unplug)->excludes(on);
  command->footer(
      "examples:\n"
      "  axlecast simulate config/demo.yaml --bus rs485-0          until Ctrl-C\n"
      "  axlecast simulate config/demo.yaml --set axis1.speed_rpm=300 --set axis1.fault=bit_flip:0.001\n"
      "  axlecast simulate config/demo.yaml --show --json\n"
      "  axlecast simulate nodes.yaml --bus can-0 --on can1        opposite a driver on can0\n"
      "keys, units and faults: docs/simulation.md");
  command->callback([options, &exit_code] { exit_code = Simulate(*options); });
}

}  // namespace axlecast
