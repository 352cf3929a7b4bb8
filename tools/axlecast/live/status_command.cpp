#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/axlecast/live/format_machine.h"
#include "tools/monitor/live_machine.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {
namespace {

constexpr MonoNs kLimitsTimeout = 65 * kSecond;  // LIMITS is published once a minute
constexpr const char* kLimitsHelp = "Also wait for the trip limits of motors: they are published once a minute";

bool KnowsLimits(const DeviceView& device) { return !device.motor || device.limits; }

struct Options {
  ConfigOption config;
  std::vector<std::string> names;  // of `info`: [CONFIG] DEVICE
  bool limits = false;
  bool all = false;
  bool json = false;
};

// Waits for LIMITS until `known` returns true, if `options` request it.
Result<> GatherLimits(const Options& options, LiveMachine& live, const Clock& clock,
                      const std::function<bool(const MachineView&)>& known) {
  return options.limits ? live.Gather(clock.Now() + kLimitsTimeout, known) : Result<>();
}

int Status(const MachineConfig& machine, const Options& options) {
  const SystemClock clock;
  LiveMachine live(machine, clock);
  const auto all_known = [](const MachineView& view) { return std::ranges::all_of(view.devices(), &KnowsLimits); };
  Result<> gathered = live.GatherAll(machine);
  if (gathered) gathered = GatherLimits(options, live, clock, all_known);
  if (!gathered) return Fail(gathered.error().text, kExitBad);
  const MonoNs now = clock.Now();
  const StatusRows rows = options.all ? StatusRows::kAll : StatusRows::kByNumber;
  Show(StatusJson(live.view(), now), StatusText(live.view(), now, rows), options.json);
  if (MachineFaults(live.view(), now).empty()) return kExitDone;
  return live.view().NothingReceived() ? kExitNoAnswer : kExitBad;
}

// Returns true if each message that the device publishes at least once a second was received.
bool Complete(const DeviceView& device) {
  return device.Received() && device.alarms.received() && (device.position || !device.has_position);
}

int Info(Options options) {
  if (options.names.size() == 2) options.config.Set(options.names.front());
  const std::string name = options.names.back();
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  if (machine->BusOf(name) == nullptr) return Fail(UnknownDevice(*machine, name), kExitUsage);
  const SystemClock clock;
  LiveMachine live(*machine, clock);
  const auto complete = [&name](const MachineView& view) { return Complete(*view.FindDevice(name)); };
  const auto known = [&name](const MachineView& view) { return KnowsLimits(*view.FindDevice(name)); };
  Result<> gathered = live.Gather(clock.Now() + GatherTime(*machine), complete);
  if (gathered) gathered = GatherLimits(options, live, clock, known);
  if (!gathered) return Fail(gathered.error().text, kExitBad);
  const DeviceView& device = *live.view().FindDevice(name);
  if (!device.info) return Fail(NoAnswer(device) + NetworkNote(live.view().reception()), kExitNoAnswer);
  Show(InfoJson(device), InfoText(device, clock.Now()), options.json);
  return kExitDone;
}

}  // namespace

void AddStatusCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("status", "Show whether all devices are online");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_flag("--limits", options->limits, kLimitsHelp);
  command->add_flag("--all", options->all,
                    "Print the row of every part, also where " + std::to_string(kMaxGoodRows + 1) +
                        " or more devices are shown as numbers");
  command->add_flag("--json", options->json, "Print one JSON object");
  command->footer(
      "example: axlecast status machine.yaml && echo good\n"
      "exit code 0 if the machine is good (docs/cli.md), 1 if not, 6 if nothing answers");
  RunOnMachine<Options>(*command, options, exit_code, &Status);
}

void AddInfoCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("info", "Show everything about one device");
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_option("DEVICE", options->names, "The device; before it, optionally, the machine's file")
      ->required()
      ->expected(1, 2)
      ->type_name("[CONFIG] DEVICE");
  command->add_flag("--limits", options->limits, kLimitsHelp);
  command->add_flag("--json", options->json, "Print one JSON object");
  command->footer("example: axlecast info machine.yaml axis1");
  command->callback([options, &exit_code] { exit_code = Info(*options); });
}

}  // namespace axlecast
