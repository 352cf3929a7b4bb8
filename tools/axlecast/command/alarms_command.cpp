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
#include "core/command/operation_check.h"
#include "core/messages/json/field.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/alarm_list.h"
#include "tools/axlecast/command/command_options.h"
#include "tools/axlecast/command/command_report.h"
#include "tools/axlecast/command/operator_client.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/screen.h"
#include "tools/axlecast/live/status_text.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

constexpr MonoNs kLook = 2500 * kMillisecond;  // DEVICE and ALARM come once a second
constexpr MonoNs kBridgeWait = 1200 * kMillisecond;

int Wrong(const std::string& problem, int exit_code) {
  std::cerr << problem << '\n';
  return exit_code;
}

// What the machine's messages show, as soon as `enough` or after kLook. Nothing when they cannot be heard.
template <typename Enough>
std::optional<MachineView> Look(const MachineConfig& machine, const SystemClock& clock, const Enough& enough) {
  LiveMachine live(machine, clock);
  if (live.problem().empty() && live.Gather(clock.Now() + kLook, enough)) return live.view();
  std::cerr << (live.problem().empty() ? "the LCM port failed" : live.problem()) << '\n';
  return std::nullopt;
}

struct ListOptions {
  ConfigOption config;
  std::string journal;
  bool json = false;
};

// Who has acknowledged and shelved what, from the bridge's journal.
MarksByDevice ReadMarks(const MachineView& view, const std::string& journal, std::string& problem) {
  MarksByDevice marks;
  HistoryReader reader(journal);
  for (const DeviceView& device : view.devices()) marks[device.name] = reader.AlarmMarks(device.name);
  problem = reader.problem();
  return marks;
}

int List(const ListOptions& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  const SystemClock clock;
  const MonoNs start = clock.Now();
  const auto view = Look(*machine, clock, [&](const MachineView& seen) {
    const bool devices = std::all_of(seen.devices().begin(), seen.devices().end(),
                                     [](const DeviceView& device) { return device.info && device.alarms.heard(); });
    return devices && (seen.bridge().heard() || clock.Now() - start > kBridgeWait);
  });
  if (!view) return kExitBad;
  std::string problem;
  const MarksByDevice marks =
      ReadMarks(*view, options.journal.empty() ? JournalFile(*machine) : options.journal, problem);
  AlarmList list = MakeAlarmList(*view, marks, clock.Now());
  list.journal_problem = problem;
  if (!problem.empty() && !options.json)
    std::cerr << "who acknowledged and shelved is not known: " << problem << '\n';
  static_cast<void>(WriteOut(options.json ? JsonLine(ToJson(list)) + '\n' : ToText(list)));
  return list.silent.size() == view->devices().size() + 1 ? kExitNoAnswer : kExitDone;
}

void AddList(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ListOptions>();
  CLI::App* command = app.add_subcommand("alarms", "All alarms, worst first, and who acknowledged or shelved them");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_option("--journal", options->journal, "The bridge's journal; else the one of the machine's file")
      ->type_name("FILE");
  command->add_flag("--json", options->json, "One JSON object");
  command->footer(
      "examples:\n  axlecast alarms machine.yaml\n  axlecast alarms --json | jq '.alarms[].name'\n"
      "exit code: 0 listed, 1 the port or the file cannot be used, 2 usage, 6 nothing answers");
  command->callback([options, &exit_code] { exit_code = List(*options); });
}

struct AckOptions {
  ConfigOption config;
  CommandOptions wish;
  std::vector<std::string> alarms;  // none: all that are listed and not shelved
};

std::optional<std::vector<std::string>> ListedAlarms(const MachineConfig& machine, const std::string& name) {
  const SystemClock clock;
  const auto view =
      Look(machine, clock, [&](const MachineView& seen) { return seen.FindDevice(name)->alarms.heard(); });
  if (!view) return std::nullopt;
  std::vector<std::string> names;
  for (const alarm_entry_t& entry : view->FindDevice(name)->alarms.entries()) {
    if (entry.state != alarm_entry_t::STATE_SHELVED) names.push_back(entry.name);
  }
  return names;
}

int Acknowledge(const AckOptions& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  const CommandOptions& wish = options.wish;
  if (machine->BusOf(wish.device) == nullptr) return Wrong(UnknownDevice(*machine, wish.device), kExitUsage);
  std::optional<std::vector<std::string>> alarms = options.alarms;
  if (alarms->empty()) alarms = ListedAlarms(*machine, wish.device);
  if (!alarms) return kExitBad;
  OperatorClient client(*machine, wish.key, false);
  if (!client.problem().empty()) return Wrong(client.problem(), kExitBad);
  nlohmann::ordered_json json = {{"device", wish.device}, {"acknowledged", nlohmann::ordered_json::array()}};
  std::string text = alarms->empty() ? wish.device + ": no alarm is listed\n" : "";
  for (const std::string& alarm : *alarms) {
    const CommandResult result = client.Execute({.device = wish.device,
                                                 .operation = std::string(kAcknowledgeAlarm),
                                                 .arguments = {{"alarm", alarm}},
                                                 .valid_ms = wish.valid_ms,
                                                 .reason = wish.reason});
    if (exit_code == kExitDone) exit_code = ExitCode(result);
    text += ToText(result);
    nlohmann::ordered_json outcome = {{"alarm", alarm}};
    outcome.update(ToJson(result));
    json["acknowledged"].push_back(std::move(outcome));
  }
  static_cast<void>(WriteOut(wish.json ? JsonLine(json) + '\n' : text));
  return exit_code;
}

void AddAck(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<AckOptions>();
  CLI::App* command = app.add_subcommand("ack", "Acknowledges alarms: somebody has seen them. Clears nothing");
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  command->add_option("ALARMS", options->alarms, "Their names; else all that are listed")->type_name("ALARM");
  AddCommandOptions(*command, options->config, options->wish, false);
  command->footer(std::string("examples:\n  axlecast ack axis1 --reason \"battery ordered\"\n"
                              "  axlecast ack axis1 battery_alarm\n"
                              "With several alarms the first outcome that is not 0 is the exit code.\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Acknowledge(*options); });
}

struct ShelfOptions {
  ConfigOption config;
  CommandOptions wish;
  std::string alarm;
  double seconds = 0;
};

int Shelve(ShelfOptions& options) {
  int exit_code = kExitDone;
  options.wish.words = {"alarm=" + options.alarm};
  if (options.wish.operation == kShelveAlarm) {
    options.wish.words.push_back("seconds=" + std::to_string(static_cast<std::int64_t>(options.seconds)));
  }
  const auto machine = options.config.Load(exit_code);
  return machine ? RunCommand(*machine, options.wish) : exit_code;
}

CLI::App* AddShelf(CLI::App& app, int& exit_code, const char* name, const char* help,
                   const std::shared_ptr<ShelfOptions>& options) {
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  command->add_option("ALARM", options->alarm, "The alarm's name")->required();
  AddCommandOptions(*command, options->config, options->wish, false);
  command->callback([options, &exit_code] { exit_code = Shelve(*options); });
  return command;
}

void AddShelve(CLI::App& app, int& exit_code) {
  constexpr double kMax = static_cast<double>(AlarmShelves::kLongestUs) / 1e6;
  auto options = std::make_shared<ShelfOptions>();
  options->wish.operation = kShelveAlarm;
  CLI::App* command =
      AddShelf(app, exit_code, "shelve", "Puts an alarm aside for a time, with a reason. Clears nothing", options);
  command->add_option("--for", options->seconds, "How long: 30s, 15min, 8h; at most 24h, then it is listed again")
      ->required()
      ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}}))
      ->check(CLI::Range(1.0, kMax))
      ->type_name("TIME");
  command->get_option("--reason")->required();
  command->footer(
      std::string("short for: axlecast do DEVICE shelve_alarm alarm=ALARM seconds=S\n"
                  "example: axlecast shelve axis1 battery_alarm --for 8h --reason \"battery comes at 14:00\"\n"
                  "A worse alarm, or the same one when it gets worse, is not put aside.\n") +
      kCommandExitCodes);
}

void AddUnshelve(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ShelfOptions>();
  options->wish.operation = kUnshelveAlarm;
  CLI::App* command = AddShelf(app, exit_code, "unshelve", "Takes an alarm off its shelf before its time", options);
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
