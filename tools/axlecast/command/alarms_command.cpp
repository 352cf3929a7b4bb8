#include "tools/axlecast/command/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/store/history.h"
#include "core/alarm/alarm_table.h"
#include "core/command/commands.h"
#include "core/messages/json/field.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/alarm_list.h"
#include "tools/axlecast/command/command_request.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

constexpr MonoNs kTimeout = 2500 * kMillisecond;  // DEVICE and ALARM are published once a second
constexpr MonoNs kBridgeWait = 1200 * kMillisecond;

struct ListOptions {
  ConfigOption config;
  std::string journal;
  bool json = false;
};

// Returns who acknowledged and shelved which alarm, from the bridge's journal.
Result<MarksByDevice> ReadMarks(const MachineView& view, const std::string& journal) {
  MarksByDevice marks;
  HistoryReader reader(journal);
  for (const DeviceView& device : view.devices()) marks[device.name] = reader.AlarmMarks(device.name);
  if (!reader.state()) return Failure(reader.state().error());
  return marks;
}

int List(const ListOptions& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const SystemClock clock;
  const MonoNs start = clock.Now();
  const auto view = Observe(*machine, clock, kTimeout, [&](const MachineView& seen) {
    const bool devices = std::all_of(seen.devices().begin(), seen.devices().end(),
                                     [](const DeviceView& device) { return device.info && device.alarms.heard(); });
    return devices && (seen.bridge().heard() || clock.Now() - start > kBridgeWait);
  });
  if (!view) return Fail(view.error().text, kExitBad);
  const auto marks = ReadMarks(*view, options.journal.empty() ? JournalFile(*machine) : options.journal);
  AlarmList list = MakeAlarmList(*view, marks.value_or(MarksByDevice()), clock.Now());
  if (!marks) {
    list.journal_problem = marks.error().text;
    if (!options.json) std::cerr << "who acknowledged and shelved is not known: " << list.journal_problem << '\n';
  }
  Show(ToJson(list), ToText(list), options.json);
  return list.silent.size() == view->devices().size() + 1 ? kExitNoAnswer : kExitDone;
}

void AddList(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ListOptions>();
  CLI::App* command =
      app.add_subcommand("alarms", "List all alarms, worst first, and who acknowledged or shelved them");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_option("--journal", options->journal, "The bridge's journal; default that of the machine's file")
      ->type_name("FILE");
  command->add_flag("--json", options->json, "Print one JSON object");
  command->footer(
      "examples:\n  axlecast alarms machine.yaml\n  axlecast alarms --json | jq '.alarms[].name'\n"
      "exit code: 0 listed, 1 the port or the file cannot be used, 2 usage, 6 no answer");
  command->callback([options, &exit_code] { exit_code = List(*options); });
}

struct AckOptions {
  ConfigOption config;
  CommandOptions command;
  std::vector<std::string> alarms;  // empty: all that are listed and not shelved
};

Result<std::vector<std::string>> ListedAlarms(const MachineConfig& machine, const std::string& name) {
  const SystemClock clock;
  const auto view = Observe(machine, clock, kTimeout,
                            [&](const MachineView& seen) { return seen.FindDevice(name)->alarms.heard(); });
  if (!view) return Failure(view.error());
  std::vector<std::string> names;
  for (const alarm_entry_t& entry : view->FindDevice(name)->alarms.entries()) {
    if (entry.state != alarm_entry_t::STATE_SHELVED) names.push_back(entry.name);
  }
  return names;
}

int Acknowledge(const AckOptions& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const CommandOptions& command = options.command;
  if (machine->BusOf(command.device) == nullptr) return Fail(UnknownDevice(*machine, command.device), kExitUsage);
  Result<std::vector<std::string>> alarms = options.alarms;
  if (alarms->empty()) alarms = ListedAlarms(*machine, command.device);
  if (!alarms) return Fail(alarms.error().text, kExitBad);
  OperatorClient client(*machine, command.key, false);
  if (!client.problem().empty()) return Fail(client.problem(), kExitBad);
  nlohmann::ordered_json json = {{"device", command.device}, {"acknowledged", nlohmann::ordered_json::array()}};
  std::string text = alarms->empty() ? command.device + ": no alarm is listed\n" : "";
  int exit_code = kExitDone;
  for (const std::string& alarm : *alarms) {
    const CommandResult result = client.Execute({.device = command.device,
                                                 .operation = std::string(kAcknowledgeAlarm),
                                                 .arguments = {{"alarm", alarm}},
                                                 .valid_ms = command.valid_ms,
                                                 .reason = command.reason});
    if (exit_code == kExitDone) exit_code = ExitCode(result);
    text += ToText(result);
    nlohmann::ordered_json outcome = {{"alarm", alarm}};
    outcome.update(ToJson(result));
    json["acknowledged"].push_back(std::move(outcome));
  }
  Show(json, text, command.json);
  return exit_code;
}

void AddAck(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<AckOptions>();
  CLI::App* command = app.add_subcommand("ack", "Acknowledge alarms. This does not clear them");
  command->add_option("DEVICE", options->command.device, "The device")->required();
  command->add_option("ALARMS", options->alarms, "Names of the alarms; default all that are listed")
      ->type_name("ALARM");
  AddCommandOptions(*command, options->config, options->command, false);
  command->footer(std::string("examples:\n  axlecast ack axis1 --reason \"battery ordered\"\n"
                              "  axlecast ack axis1 battery_alarm\n"
                              "With several alarms, the exit code is the first that is not 0.\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Acknowledge(*options); });
}

struct ShelfOptions {
  ConfigOption config;
  CommandOptions command;
  std::string alarm;
  double seconds = 0;
};

int Shelve(ShelfOptions& options) {
  options.command.arguments = {"alarm=" + options.alarm};
  if (options.command.operation == kShelveAlarm) {
    options.command.arguments.push_back("seconds=" + std::to_string(static_cast<std::int64_t>(options.seconds)));
  }
  const auto machine = options.config.Load();
  return machine ? RunCommand(*machine, options.command) : options.config.Fail(machine.error());
}

CLI::App* AddShelf(CLI::App& app, int& exit_code, const char* name, const char* help,
                   const std::shared_ptr<ShelfOptions>& options) {
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("DEVICE", options->command.device, "The device")->required();
  command->add_option("ALARM", options->alarm, "The alarm's name")->required();
  AddCommandOptions(*command, options->config, options->command, false);
  command->callback([options, &exit_code] { exit_code = Shelve(*options); });
  return command;
}

void AddShelve(CLI::App& app, int& exit_code) {
  constexpr double kMax = static_cast<double>(AlarmShelves::kLongestUs) / 1e6;
  auto options = std::make_shared<ShelfOptions>();
  options->command.operation = kShelveAlarm;
  CLI::App* command = AddShelf(app, exit_code, "shelve",
                               "Shelve an alarm for a time, with a reason. This does not clear it", options);
  command
      ->add_option("--for", options->seconds,
                   "Duration: 30s, 15min, 8h; at most 24h. The alarm is then listed again")
      ->required()
      ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}}))
      ->check(CLI::Range(1.0, kMax))
      ->type_name("TIME");
  command->get_option("--reason")->required();
  command->footer(
      std::string("short for: axlecast do DEVICE shelve_alarm alarm=ALARM seconds=S\n"
                  "example: axlecast shelve axis1 battery_alarm --for 8h --reason \"battery comes at 14:00\"\n"
                  "If the alarm gets worse, it is listed again.\n") +
      kCommandExitCodes);
}

void AddUnshelve(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ShelfOptions>();
  options->command.operation = kUnshelveAlarm;
  CLI::App* command = AddShelf(app, exit_code, "unshelve", "Unshelve an alarm before its time", options);
  command->footer(std::string("short for: axlecast do DEVICE unshelve_alarm alarm=ALARM\n"
                              "example: axlecast unshelve axis1 battery_alarm\n") +
                  kCommandExitCodes);
}

}  // namespace

void AddAlarmCommands(CLI::App& app, int& exit_code) {
  AddList(app, exit_code);
  AddAck(app, exit_code);
  AddShelve(app, exit_code);
  AddUnshelve(app, exit_code);
}

}  // namespace axlecast
