#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/config/hosts.h"
#include "core/config/load.h"
#include "platform/os/folder.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/run/simulation_server.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

struct SimulateOptions {
  ConfigOption config;
  std::string host;
  std::vector<std::string> buses;
  std::vector<std::string> changes;
  std::string interface;
  bool show = false;
  bool json = false;
  bool unplug = false;
  bool plug = false;
};

using Buses = std::vector<const BusConfig*>;

std::string Place(const MachineConfig& machine, const BusConfig& bus, const char* suffix) {
  return RunDirectory(machine.machine) + '/' + bus.name + suffix;
}

// Returns the named buses, or all simulated buses of this host if no bus is named. Fails if a named bus is not simulated.
Result<Buses> SimulatedBuses(const MachineConfig& machine, const SimulateOptions& options) {
  const std::vector<std::string>& names = options.buses;
  const std::string host = ThisHost(options.host);
  Buses buses;
  for (const BusConfig& bus : machine.buses) {
    const bool here = machine.hosts.empty() || HostOfBus(machine.hosts, bus.name)->name == host;
    if (names.empty() && bus.simulate && here) buses.push_back(&bus);
  }
  for (const std::string& name : names) {
    const BusConfig* bus = machine.FindBus(name);
    if (bus == nullptr) return Failure(machine.file + ": no bus '" + name + "'");
    if (!bus->simulate) return Failure(machine.file + ": no `simulate: true` at bus '" + name + "'");
    buses.push_back(bus);
  }
  if (buses.empty()) {
    const std::string where = machine.hosts.empty() ? "" : " of host '" + host + "'";
    return Failure(machine.file + ": no bus" + where + " has `simulate: true`");
  }
  return buses;
}

// ---- running ----

SimulationServer* signalled = nullptr;  // stopped by SIGTERM and SIGINT

void StopOnSignals(SimulationServer& server) {
  signalled = &server;
  struct sigaction action {};
  action.sa_handler = [](int) { signalled->Stop(); };
  for (const int number : {SIGTERM, SIGINT}) static_cast<void>(sigaction(number, &action, nullptr));
}

Result<> AddBus(SimulationServer& server, const MachineConfig& machine, const BusConfig& bus, SimulatorMaker& maker,
                const ConfigErrors& errors, const std::string& interface) {
  std::unique_ptr<Simulator> simulator = maker.Make(bus);
  if (!simulator) return Failure(errors.Text());
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

int RunSimulators(const MachineConfig& machine, const Buses& buses, const std::string& interface) {
  if (!interface.empty() && buses.size() > 1) {
    return Fail("--on " + interface + ": an interface carries one bus; name it with --bus", kExitUsage);
  }
  if (!interface.empty() && buses[0]->family->link != LinkKind::kCan) {
    return Fail("--on " + interface + ": bus " + buses[0]->name + " is no CAN bus", kExitUsage);
  }
  const SystemClock clock;
  SimulationServer server(clock);
  StopOnSignals(server);
  Result<> done = PrepareRunDirectory(RunDirectory(machine.machine));
  ConfigErrors errors(machine.file);
  SimulatorMaker maker(machine, errors);
  for (const BusConfig* bus : buses) {
    if (done) done = AddBus(server, machine, *bus, maker, errors, interface);
    if (!done) break;
    std::cout << "simulating bus " << bus->name << " on " << (interface.empty() ? bus->link.port : interface)
              << std::endl;
  }
  if (done) done = server.Run();
  return done ? kExitDone : Fail(done.error().text, kExitBad);
}

// ---- querying and changing running simulators ----

Result<Json> Ask(const MachineConfig& machine, const BusConfig& bus, const Json& question) {
  Json answer = Json::parse(AskControlSocket(Place(machine, bus, ".ctl"), question.dump()), nullptr, false);
  if (answer.is_object()) return answer;
  return Failure("no simulator runs for bus " + bus.name + ": start it with `axlecast simulate " + machine.file +
                 " --bus " + bus.name + "`");
}

// Returns a text without quotation marks.
std::string PlainText(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

int ShowBuses(const MachineConfig& machine, const Buses& buses, bool json) {
  for (const BusConfig* bus : buses) {
    const Result<Json> state = Ask(machine, *bus, {{"show", true}});
    if (!state) return Fail(state.error().text, kExitNoAnswer);
    if (json) {
      std::cout << state->dump() << '\n';
      continue;
    }
    const char* host = state->value("host", false) ? "host" : "no host";
    std::cout << bus->name << "  " << state->value("port", "") << "  "
              << (state->value("plugged", true) ? host : "unplugged") << '\n';
    for (const auto& [device, quantities] : (*state)["devices"].items()) {
      for (const auto& [name, value] : quantities.items()) {
        std::cout << "  " << device << '.' << name << " = " << PlainText(value) << '\n';
      }
    }
  }
  return kExitDone;
}

using Changes = std::map<const BusConfig*, Json>;

// Adds "axis1.speed_rpm=300" to the changes of the device's bus, as device, key and value.
Result<> AddChange(const MachineConfig& machine, const std::string& text, Changes& changes) {
  const std::size_t dot = text.find('.');
  const std::size_t equals = text.find('=');
  if (dot == 0 || equals == std::string::npos || dot + 1 >= equals) {
    return Failure("'" + text + "' is not DEVICE.KEY=VALUE, e.g. axis1.speed_rpm=300");
  }
  const std::string device = text.substr(0, dot);
  const BusConfig* bus = machine.BusOf(device);
  if (bus == nullptr || !bus->simulate) return Failure(machine.file + ": no simulated device '" + device + "'");
  changes[bus]["set"].push_back({device, text.substr(dot + 1, equals - dot - 1), text.substr(equals + 1)});
  return {};
}

int ChangeAll(const MachineConfig& machine, const SimulateOptions& options) {
  Changes changes;
  for (const std::string& text : options.changes) {
    if (const Result<> added = AddChange(machine, text, changes); !added)
      return Fail(added.error().text, kExitUsage);
  }
  if (options.plug || options.unplug) {
    const Result<Buses> buses = SimulatedBuses(machine, options);
    if (!buses) return Fail(buses.error().text, kExitUsage);
    for (const BusConfig* bus : *buses) changes[bus]["plugged"] = options.plug;
  }
  int worst = kExitDone;
  for (const auto& [bus, question] : changes) {
    const Result<Json> answer = Ask(machine, *bus, question);
    if (!answer) {
      worst = std::max(worst, Fail(answer.error().text, kExitNoAnswer));
      continue;
    }
    for (const Json& error : answer->value("errors", Json::array())) {
      worst = std::max(worst, Fail(PlainText(error), kExitBad));
    }
  }
  return worst;
}

bool IsChange(const SimulateOptions& options) { return !options.changes.empty() || options.plug || options.unplug; }

// To run one bus, reads only the part of this bus, as its driver does: `up` starts a process for each of hundreds of buses. If this part
// has an error, reads the whole file and reports all errors.
Result<MachineConfig> LoadMachine(const SimulateOptions& options) {
  if (options.buses.size() == 1 && !IsChange(options) && !options.show) {
    if (Result<MachineConfig> part = options.config.Load(options.buses.front())) return part;
  }
  return options.config.Load();
}

int Simulate(const MachineConfig& machine, const SimulateOptions& options) {
  const bool changing = IsChange(options);
  const int exit_code = changing ? ChangeAll(machine, options) : kExitDone;
  if (exit_code != kExitDone || (changing && !options.show)) return exit_code;
  const Result<Buses> buses = SimulatedBuses(machine, options);
  if (!buses) return Fail(buses.error().text, kExitUsage);
  if (options.show) return ShowBuses(machine, *buses, options.json);
  return RunSimulators(machine, *buses, options.interface);
}

}  // namespace

void AddSimulateCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App* command =
      app.add_subcommand("simulate", "Run the simulators of a machine's buses, or change running ones");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  AddHostOption(*command, options->host);
  command->add_option("--bus", options->buses, "Only this bus; repeat it for more; default all simulated buses")
      ->type_name("NAME")
      ->allow_extra_args(false);
  CLI::Option* on = command
                        ->add_option("--on", options->interface,
                                     "Put the nodes of one CAN bus on this interface instead of a simulated bus")
                        ->type_name("IFACE");
  command->add_option("--set", options->changes, "Change a running simulator; repeat it for more changes")
      ->type_name("DEVICE.KEY=VALUE")
      ->allow_extra_args(false)
      ->excludes(on);
  command->add_flag("--show", options->show, "Print the state of running simulators, with what was done to them")
      ->excludes(on);
  command->add_flag("--json", options->json, "With --show: print one JSON object per bus")->needs("--show");
  CLI::Option* unplug =
      command->add_flag("--unplug", options->unplug, "Remove the port of a running simulator")->excludes(on);
  command->add_flag("--plug", options->plug, "Restore the port")->excludes(unplug)->excludes(on);
  command->footer(
      "examples:\n"
      "  axlecast simulate config/demo.yaml --bus rs485-0          until Ctrl-C\n"
      "  axlecast simulate config/demo.yaml --set axis1.speed_rpm=300 --set axis1.fault=bit_flip:0.001\n"
      "  axlecast simulate config/demo.yaml --show --json\n"
      "  axlecast simulate nodes.yaml --bus can-0 --on can1        for a driver on can0\n"
      "keys, units and faults: docs/simulation.md");
  command->callback([options, &exit_code] {
    const Result<MachineConfig> machine = LoadMachine(*options);
    exit_code = machine ? Simulate(*machine, *options) : options->config.Fail(machine.error());
  });
}

}  // namespace axlecast
