#include "tools/axlecast/command/alarms_command.h"
#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <tuple>

#include "bridge/store/history.h"
#include "core/alarm/alarm_table.h"
#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;
using Kind = AlarmMark::Kind;

std::optional<AlarmMark> Find(const std::vector<AlarmMark>& marks, Kind kind, const std::string& alarm) {
  const auto found =
      std::ranges::find_if(marks, [&](const AlarmMark& mark) { return mark.kind == kind && mark.alarm == alarm; });
  return found == marks.end() ? std::nullopt : std::optional(*found);
}

int Rank(const alarm_entry_t& entry) {
  if (entry.state == alarm_entry_t::STATE_SHELVED) return 2;
  return entry.state == alarm_entry_t::STATE_UNACKNOWLEDGED ? 1 : 0;
}

bool Before(const ListedAlarm& a, const ListedAlarm& b) {
  const auto key = [](const ListedAlarm& alarm) {
    return std::tuple(Rank(alarm.entry), -alarm.entry.severity, -alarm.entry.first_utime);
  };
  return key(a) < key(b);
}

void AddDevice(const DeviceView& device, const std::vector<AlarmMark>& marks, MonoNs now, AlarmList& list) {
  if (!device.State(now) || !device.alarms.received()) {
    list.silent.push_back(device.name);
    return;
  }
  for (const alarm_entry_t& entry : device.alarms.entries()) {
    ListedAlarm alarm{.device = device.name, .entry = entry};
    if (Rank(entry) == 2) alarm.shelved = Find(marks, Kind::kShelved, entry.name);
    if (Rank(entry) != 1) alarm.acknowledged = Find(marks, Kind::kAcknowledged, entry.name);
    list.alarms.push_back(std::move(alarm));
  }
  list.not_shown += static_cast<int>(device.alarms.total() - device.alarms.entries().size());
  for (const AlarmMark& mark : marks) {
    const bool listed = std::ranges::any_of(device.alarms.entries(),
                                            [&](const alarm_entry_t& entry) { return entry.name == mark.alarm; });
    if (mark.kind == Kind::kShelved && !listed) list.idle_shelves.emplace_back(device.name, mark);
  }
}

// "by local, 2026-11-22 04:00:00 UTC: seen"
std::string ByText(const AlarmMark& mark) {
  return "by " + Printable(mark.who) + ", " + UtcText(mark.utime) + " UTC" +
         (mark.reason.empty() ? "" : ": " + Printable(mark.reason));
}

std::string ShelfText(const AlarmMark& mark) {
  return "shelved until " + UtcText(mark.until_utime) + " UTC, up to severity " + Printable(mark.up_to) + ", " +
         ByText(mark);
}

std::string ListedRows(const ListedAlarm& alarm) {
  const alarm_entry_t& entry = alarm.entry;
  std::string text = Left(SeverityName(entry.severity), 9) + Left(AlarmStateName(entry.state), 15) +
                     UtcText(entry.first_utime) + "  " + Left(alarm.device, 16) + ' ' + Printable(entry.name) +
                     '\n';
  const std::string indent = "         ";
  if (!entry.action.empty()) text += indent + Printable(entry.action) + '\n';
  if (alarm.acknowledged) text += indent + "acknowledged " + ByText(*alarm.acknowledged) + '\n';
  if (alarm.shelved) text += indent + ShelfText(*alarm.shelved) + '\n';
  return text;
}

Json MarkJson(const AlarmMark& mark) {
  Json json = {
      {"who", mark.who}, {"utime", mark.utime}, {"reason", mark.reason}, {"command", IdText(mark.command)}};
  if (mark.kind == Kind::kShelved) {
    json["until_utime"] = mark.until_utime;
    json["up_to"] = mark.up_to;
  }
  return json;
}

Json MarkJson(const std::optional<AlarmMark>& mark) { return mark ? MarkJson(*mark) : Json(nullptr); }

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

int List(const MachineConfig& machine, const ListOptions& options) {
  const SystemClock clock;
  const MonoNs start = clock.Now();
  const auto view = Observe(machine, clock, kTimeout, [&](const MachineView& seen) {
    const bool devices = std::ranges::all_of(
        seen.devices(), [](const DeviceView& device) { return device.info && device.alarms.received(); });
    return devices && (seen.bridge().received() || clock.Now() - start > kBridgeWait);
  });
  if (!view) return Fail(view.error().text, kExitBad);
  const auto marks = ReadMarks(*view, options.journal.empty() ? JournalFile(machine) : options.journal);
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
  RunOnMachine<ListOptions>(*command, options, exit_code, &List);
}

struct AckOptions {
  ConfigOption config;
  CommandOptions command;
  std::vector<std::string> alarms;  // empty: all that are listed and not shelved
};

Result<std::vector<std::string>> ListedAlarms(const MachineConfig& machine, const std::string& name) {
  const SystemClock clock;
  const auto view = Observe(machine, clock, kTimeout,
                            [&](const MachineView& seen) { return seen.FindDevice(name)->alarms.received(); });
  if (!view) return Failure(view.error());
  std::vector<std::string> names;
  for (const alarm_entry_t& entry : view->FindDevice(name)->alarms.entries()) {
    if (entry.state != alarm_entry_t::STATE_SHELVED) names.push_back(entry.name);
  }
  return names;
}

int Acknowledge(const MachineConfig& machine, const AckOptions& options) {
  const CommandOptions& command = options.command;
  if (machine.BusOf(command.device) == nullptr) return Fail(UnknownDevice(machine, command.device), kExitUsage);
  Result<std::vector<std::string>> alarms = options.alarms;
  if (alarms->empty()) alarms = ListedAlarms(machine, command.device);
  if (!alarms) return Fail(alarms.error().text, kExitBad);
  OperatorClient client(machine, command.key, false);
  if (const auto ready = client.state(); !ready) return Fail(ready.error().text, kExitBad);
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
  RunOnMachine<AckOptions>(*command, options, exit_code, &Acknowledge);
}

}  // namespace

AlarmList MakeAlarmList(const MachineView& machine, const MarksByDevice& marks, MonoNs now) {
  AlarmList list{.machine = machine.machine()};
  for (const DeviceView& device : machine.devices()) {
    const auto own = marks.find(device.name);
    AddDevice(device, own == marks.end() ? std::vector<AlarmMark>() : own->second, now, list);
  }
  if (!machine.bridge().Fresh(now)) list.silent.emplace_back("bridge");
  for (const alarm_entry_t& entry : machine.bridge().entries()) {
    if (machine.bridge().Fresh(now)) list.alarms.push_back({.device = "bridge", .entry = entry});
  }
  std::ranges::stable_sort(list.alarms, Before);
  return list;
}

std::string ToText(const AlarmList& list) {
  std::string text;
  if (!list.alarms.empty()) text = "SEVERITY STATE          SINCE (UTC)          DEVICE           ALARM\n";
  for (const ListedAlarm& alarm : list.alarms) text += ListedRows(alarm);
  for (const auto& [device, mark] : list.idle_shelves) {
    text += device + ' ' + Printable(mark.alarm) + " is not listed; " + ShelfText(mark) + '\n';
  }
  for (const std::string& device : list.silent) text += device + " is silent: its alarms are not known\n";
  if (list.not_shown > 0)
    text += std::to_string(list.not_shown) + " more: ALARM holds 8 of a device, worst first\n";
  return text.empty() ? "no alarms\n" : text;
}

Json ToJson(const AlarmList& list) {
  Json json = {{"machine", list.machine}, {"alarms", Json::array()}};
  for (const ListedAlarm& alarm : list.alarms) {
    Json entry = {{"device", alarm.device}};
    entry.update(ToJson(alarm.entry));
    entry["acknowledged"] = MarkJson(alarm.acknowledged);
    entry["shelved"] = MarkJson(alarm.shelved);
    json["alarms"].push_back(std::move(entry));
  }
  json["idle_shelves"] = Json::array();
  for (const auto& [device, mark] : list.idle_shelves) {
    Json entry = {{"device", device}, {"alarm", mark.alarm}};
    entry.update(MarkJson(mark));
    json["idle_shelves"].push_back(std::move(entry));
  }
  json["silent"] = list.silent;
  json["not_shown"] = list.not_shown;
  json["journal_problem"] = list.journal_problem.empty() ? Json(nullptr) : Json(list.journal_problem);
  return json;
}

void AddAlarmCommands(CLI::App& app, int& exit_code) {
  AddList(app, exit_code);
  AddAck(app, exit_code);
  AddShelvingCommands(app, exit_code);
}

}  // namespace axlecast
