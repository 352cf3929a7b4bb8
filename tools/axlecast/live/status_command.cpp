#include "tools/axlecast/live/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/messages/json/field.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/screen.h"
#include "tools/axlecast/live/status_text.h"
#include "tools/monitor/live_machine.h"
#include "tools/monitor/machine_faults.h"

namespace axlecast {
namespace {

constexpr MonoNs kLimitsWait = 65 * kSecond;  // LIMITS comes once a minute
constexpr const char* kLimitsHelp = "Wait for the trip limits of motors too: they come once a minute";

bool KnowsLimits(const DeviceView& device) { return !device.motor || device.limits; }

struct Options {
  ConfigOption config;
  std::vector<std::string> names;  // of `info`: [CONFIG] DEVICE
  bool limits = false;
  bool json = false;
};

int Show(const nlohmann::ordered_json& json, const std::string& text, bool as_json) {
  static_cast<void>(WriteOut(as_json ? JsonLine(json) + '\n' : text));
  return kExitDone;
}

// False when the port failed.
bool GatherLimits(const Options& options, LiveMachine& live, const Clock& clock,
                  const std::function<bool(const MachineView&)>& known) {
  return !options.limits || live.Gather(clock.Now() + kLimitsWait, known);
}

int Status(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  const SystemClock clock;
  LiveMachine live(*machine, clock);
  if (!live.problem().empty() || !live.GatherAll(*machine) ||
      !GatherLimits(options, live, clock, [](const MachineView& view) {
        return std::all_of(view.devices().begin(), view.devices().end(), &KnowsLimits);
      })) {
    std::cerr << (live.problem().empty() ? "the LCM port failed" : live.problem()) << '\n';
    return kExitBad;
  }
  const MonoNs now = clock.Now();
  Show(StatusJson(live.view(), now), StatusText(live.view(), now), options.json);
  if (MachineFaults(live.view(), now).empty()) return kExitDone;
  return live.view().NoneHeard() ? kExitNoAnswer : kExitBad;
}

// All that is told of a device at least once a second has come.
bool Complete(const DeviceView& device) {
  return device.Heard() && device.alarms.heard() && (device.position || !device.has_position);
}

int Info(Options options) {
  if (options.names.size() == 2) options.config.Set(options.names.front());
  const std::string name = options.names.back();
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  if (machine->BusOf(name) == nullptr) {
    std::cerr << UnknownDevice(*machine, name) << '\n';
    return kExitUsage;
  }
  const SystemClock clock;
  LiveMachine live(*machine, clock);
  const auto complete = [&name](const MachineView& view) { return Complete(*view.FindDevice(name)); };
  const auto knows = [&name](const MachineView& view) { return KnowsLimits(*view.FindDevice(name)); };
  if (!live.problem().empty() || !live.Gather(clock.Now() + GatherTime(*machine), complete) ||
      !GatherLimits(options, live, clock, knows)) {
    std::cerr << (live.problem().empty() ? "the LCM port failed" : live.problem()) << '\n';
    return kExitBad;
  }
  const DeviceView& device = *live.view().FindDevice(name);
  if (!device.info) {
    std::cerr << name << ": no answer; is its driver running? (axlecast driver " << device.bus << ")\n";
    return kExitNoAnswer;
  }
  return Show(InfoJson(device), InfoText(device, clock.Now()), options.json);
}

}  // namespace

void AddStatusCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("status", "Is everything online?");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_flag("--limits", options->limits, kLimitsHelp);
  command->add_flag("--json", options->json, "One JSON object");
  command->footer(
      "example: axlecast status machine.yaml && echo good\n"
      "exit code 0 when the machine is good (docs/cli.md), 1 when not, 6 when nothing answers");
  command->callback([options, &exit_code] { exit_code = Status(*options); });
}

void AddInfoCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("info", "Everything about one device");
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_option("DEVICE", options->names, "The device; before it, optionally, the machine's file")
      ->required()
      ->expected(1, 2)
      ->type_name("[CONFIG] DEVICE");
  command->add_flag("--limits", options->limits, kLimitsHelp);
  command->add_flag("--json", options->json, "One JSON object");
  command->footer("example: axlecast info machine.yaml axis1");
  command->callback([options, &exit_code] { exit_code = Info(*options); });
}

}  // namespace axlecast
