#include "tools/axlecast/command/alarm_list.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/command/command_id.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;
using Kind = AlarmMark::Kind;

std::optional<AlarmMark> Find(const std::vector<AlarmMark>& marks, Kind kind, const std::string& alarm) {
  const auto found = std::find_if(marks.begin(), marks.end(),
                                  [&](const AlarmMark& mark) { return mark.kind == kind && mark.alarm == alarm; });
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
  if (!device.State(now) || !device.alarms.heard()) {
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
    const bool listed = std::any_of(device.alarms.entries().begin(), device.alarms.entries().end(),
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
  std::stable_sort(list.alarms.begin(), list.alarms.end(), Before);
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

}  // namespace axlecast
