#include "tools/axlecast/live/format_machine.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>

#include "core/base/text.h"
#include "core/device/reading.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/live/format_counts.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/machine_counts.h"
#include "tools/monitor/trip_margins.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kUnsignedWarning =
    "unsigned commands are obeyed (bridge: unsigned_commands: allow): anybody on the network segment can command "
    "it";

constexpr const char* kGoodText = "good: every device ONLINE, every bus UP\n";

std::string Row(std::string_view name, const std::string& value) { return Left(name, 18) + value + '\n'; }

std::string AlarmRows(const DeviceView& device) {
  std::string text;
  for (const alarm_entry_t& alarm : device.alarms.entries()) {
    text += Row("alarm", Printable(alarm.name) + " (" + std::string(SeverityName(alarm.severity)) + ", " +
                             std::string(AlarmStateName(alarm.state)) + "): " + Printable(alarm.action));
  }
  return text;
}

Json AlarmsJson(const std::vector<alarm_entry_t>& alarms) {
  Json json = Json::array();
  for (const alarm_entry_t& alarm : alarms) json.push_back(ToJson(alarm));
  return json;
}

// The reason of a silent part whose newest message is this old.
std::string SilenceText(MonoNs age) {
  return "the last message came " + Decimal(static_cast<double>(age) / 1e9, 1) + " s ago";
}

std::string InBrackets(const std::string& reason) { return reason.empty() ? "" : "  (" + reason + ')'; }

std::string DeviceRows(const DeviceView& device, MonoNs now) {
  std::string reason = device.info ? Printable(device.info->reason) : "no driver answers";
  if (device.info && !device.State(now)) reason = SilenceText(now - std::max(device.info_at, device.reading_at));
  std::string text = Left(device.name, 24) + ' ' + Left(device.StateText(now), 9) + ' ' +
                     Right(ValueText(device), 22) + "  " + AlarmText(device, 24) +
                     (device.Online(now) ? "" : InBrackets(reason)) + '\n';
  if (const std::string margins = MarginsText(device); !margins.empty())
    text += std::string(25, ' ') + margins + '\n';
  return text;
}

std::string BusRow(const BusView& bus, MonoNs now) {
  const std::string errors = bus.health ? ErrorCounts(bus.health->errors) : "";
  std::string reason = bus.health ? Printable(bus.health->last_error) : "the bus never reported";
  if (bus.health && !bus.State(now)) reason = SilenceText(now - bus.health_at);
  return Left(bus.name, 24) + ' ' + Left(bus.StateText(now), 9) + ' ' +
         (errors.empty() ? "" : "errors: " + errors) + (bus.Up(now) ? "" : InBrackets(reason)) + '\n';
}

std::string BridgeRows(const AlarmView& bridge, MonoNs now) {
  const std::string name = Left("bridge", 24) + ' ';
  if (!bridge.Fresh(now)) return name + "SILENT    (no bridge serves: nothing can be commanded)\n";
  if (bridge.entries().empty()) return name + "SERVING\n";
  std::string text;
  for (const alarm_entry_t& alarm : bridge.entries()) {
    text += name + "SERVING   " + Printable(alarm.name) + " (" + std::string(SeverityName(alarm.severity)) +
            "): " + Printable(alarm.action) + '\n';
  }
  return text;
}

// LIMITS and what is left to them, into a device's JSON.
void AddLimits(const DeviceView& device, Json& json) {
  json["limits"] = device.limits ? ToJson(*device.limits) : Json(nullptr);
  json["margins"] =
      device.limits && device.motor ? MarginsJson(TripMargins(*device.motor, *device.limits)) : Json(nullptr);
}

std::string LimitRows(const DeviceView& device) {
  if (!device.limits)
    return Row("trip limits", "not received yet, they come once a minute: --limits waits for them");
  std::string text;
  for (const std::string& limit : LimitTexts(device)) text += Row("trip limit", limit);
  return text;
}

std::string MotorRows(const DeviceView& device) {
  if (!device.motor) return Row("motor", "no reading yet");
  const motor_health_t& motor = *device.motor;
  std::string text = Row("motor", MotorQuantities(motor)) + Row("status", MotorStatusText(motor)) +
                     Row("trips", std::to_string(motor.trip_count));
  for (std::size_t i = 0; i < std::size(motor.trip_factor); ++i) {
    const std::string factors = MotorStatusNames(motor.trip_factor[i]);
    if (!factors.empty()) text += Row("trip " + std::to_string(i + 1), factors + (i == 0 ? " (newest)" : ""));
  }
  return text + LimitRows(device);
}

std::string PositionRows(const DeviceView& device) {
  if (!device.position) return Row("position", "none yet");
  const position_t& position = *device.position;
  return Row("value", ValueText(device)) + Row("turns", Decimal(device.Turns(), 6)) +
         Row("speed", Decimal(device.SpeedRpm(), 2) + " rpm") +
         Row("raw",
             std::to_string(position.raw_counts) + " counts, " + std::to_string(position.raw_turns) + " turns") +
         Row("flags", FlagNames(position.flags));
}

std::string ScaleRows(const device_info_t& info) {
  return Row("counts per turn", std::to_string(info.counts_per_turn)) +
         Row("turns range", info.turns_range == 0 ? "single-turn" : std::to_string(info.turns_range)) +
         Row("per turn", Decimal(info.per_turn, 6) + ' ' + std::string(UnitName(info.unit)) + " x " +
                             std::to_string(info.ratio_num) + "/" + std::to_string(info.ratio_den)) +
         Row("direction", info.direction > 0 ? "ccw" : "cw") +
         Row("datum", std::to_string(info.datum_counts) + " counts, epoch " + std::to_string(info.datum_epoch) +
                          (info.reference_lost != 0 ? ", reference lost" : ""));
}

std::string Period(std::int32_t us) { return us > 0 ? Decimal(1e6 / us, 1) + " Hz" : "as fast as the bus allows"; }

std::string ClockTime(MonoNs running) {
  const long long seconds = running / kSecond;
  std::array<char, 32> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%02lld:%02lld:%02lld", seconds / 3600,
                                  seconds / 60 % 60, seconds % 60));
  return text.data();
}

std::string DeviceLine(const DeviceView& device, MonoNs now) {
  const std::string head = Left(device.name, 12) + ' ' + Left(device.StateText(now), 8) + ' ' +
                           Right(ValueText(device), 19) + ' ' + Right(Decimal(device.Turns(), 3), 10) + ' ' +
                           Right(Decimal(device.SpeedRpm(), 1), 8) + ' ';
  std::string note = AlarmText(device, kTableWidth - head.size());
  if (note.empty() && !device.Online(now) && device.info) note = Printable(device.info->reason);
  return head + Clip(note, kTableWidth - head.size());
}

// A section for encoders, one for motors; each only where there are any.
void AddDevices(const MachineView& machine, MonoNs now, std::vector<std::string>& lines) {
  std::vector<std::string> motors;
  std::vector<std::string> axes;
  for (const DeviceView& device : machine.devices()) {
    if (device.has_position) {
      axes.push_back(DeviceLine(device, now));
    } else {
      AddMotorRows(device, now, motors);
    }
  }
  const auto add = [&lines](const std::string& heading, const std::vector<std::string>& rows) {
    if (rows.empty()) return;
    lines.push_back(heading);
    lines.insert(lines.end(), rows.begin(), rows.end());
    lines.emplace_back();
  };
  add("DEVICE       STATE                  VALUE      TURNS      RPM ALARMS", axes);
  add(MotorHeading(), motors);
}

void AddBus(const BusView& bus, MonoNs now, std::vector<std::string>& lines) {
  const std::string head = Left(bus.name, 12) + ' ' + Left(bus.StateText(now), 8);
  if (!bus.health) {
    lines.push_back(head);
    return;
  }
  const bus_health_t& health = *bus.health;
  const std::string rate = Decimal(health.rate_hz, 0) + " of " + Decimal(health.wire_limit_hz, 0) + "/s " +
                           Right(Decimal(100.0 * health.utilisation, 1), 5) + " %";
  lines.push_back(head + ' ' + Right(rate, 25) + ' ' + Right(Decimal(health.exchange_us[1], 0), 6) +
                  Right(Decimal(health.exchange_us[2], 0), 6) + ' ' + Right(std::to_string(health.good), 10) +
                  Right(std::to_string(health.late), 8));
  const std::string errors = ErrorCounts(health.errors);
  if (!errors.empty()) lines.push_back(Clip("  errors: " + errors, kTableWidth));
  if (!bus.Up(now) && !health.last_error.empty()) {
    lines.push_back(Clip("  " + Printable(health.last_error), kTableWidth));
  }
}

// On as many lines as it needs, at most three.
void AddEvent(const std::string& event, std::vector<std::string>& lines) {
  constexpr std::size_t kMaxLines = 3;
  constexpr std::string_view kIndent = "    ";
  std::string rest = Printable(event);
  for (std::size_t line = 1; line < kMaxLines && rest.size() > kTableWidth; ++line) {
    const std::size_t space = rest.rfind(' ', kTableWidth);
    const std::size_t end = space == std::string::npos || space <= kIndent.size() ? kTableWidth : space;
    lines.push_back(rest.substr(0, end));
    rest = std::string(kIndent) + rest.substr(end + (end == space ? 1 : 0));
  }
  lines.push_back(Clip(rest, kTableWidth));
}

// Adds faults of the whole run, which MachineFaults cannot detect.
void AddFaults(const DeviceView& device, std::vector<std::string>& faults) {
  if (device.info && !device.was_online) faults.push_back(device.name + ": was never ONLINE");
  const std::string reading = device.has_position ? "position" : "reading";
  if (device.valid_readings == 0) faults.push_back(device.name + ": no valid " + reading);
  if (device.readings.lost() > 0) {
    faults.push_back(device.name + ": " + std::to_string(device.readings.lost()) + ' ' + reading +
                     "s lost on the way here");
  }
}

double Rate(const DeviceView& device, double seconds) {
  return seconds > 0 ? static_cast<double>(device.readings.received()) / seconds : 0;
}

Json DeviceJson(const DeviceView& device, MonoNs now, double seconds) {
  Json json;
  json["device"] = device.name;
  json["bus"] = device.bus;
  json["state"] = device.StateText(now);
  json["was_online"] = device.was_online;
  json["received"] = device.readings.received();
  json["valid"] = device.valid_readings;
  json["lost"] = device.readings.lost();
  json["rate_hz"] = Field(Rate(device, seconds));
  if (device.has_position) {
    json["value"] = device.valid ? Field(device.valid->value) : Json(nullptr);
    json["unit"] = device.valid ? Json(UnitName(device.valid->unit)) : Json(nullptr);
    json["turns"] = Field(device.Turns());
    json["speed_rpm"] = Field(device.SpeedRpm());
  } else {
    json["motor"] = device.motor ? ToJson(*device.motor) : Json(nullptr);
  }
  json["alarms_seen"] = Json::array();
  for (const std::string& name : device.alarms.seen()) json["alarms_seen"].push_back(name);
  return json;
}

Json BusJson(const BusView& bus, MonoNs now) {
  Json json;
  json["bus"] = bus.name;
  json["state"] = bus.StateText(now);
  if (!bus.health) return json;
  const bus_health_t& health = *bus.health;
  json["exchanges"] = health.exchanges;
  json["good"] = health.good;
  json["errors"] = Json::object();
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
    if (health.errors[kind] != 0) json["errors"][ErrorName(static_cast<ErrorKind>(kind))] = health.errors[kind];
  }
  json["late"] = health.late;
  json["rate_hz"] = Field(health.rate_hz);
  json["wire_limit_hz"] = Field(health.wire_limit_hz);
  return json;
}

std::string DeviceText(const DeviceView& device, MonoNs now, double seconds) {
  std::string alarms;
  for (const std::string& name : device.alarms.seen()) alarms += (alarms.empty() ? "" : ",") + Printable(name);
  return Left(device.name, 12) + ' ' + Left(device.StateText(now), 8) + ' ' +
         Right(std::to_string(device.readings.received()), 9) + ' ' + Right(Decimal(Rate(device, seconds), 1), 8) +
         ' ' + Right(std::to_string(device.readings.lost()), 6) + ' ' + Right(ValueText(device), 19) + ' ' +
         (alarms.empty() ? "-" : alarms) + '\n';
}

std::string BusText(const BusView& bus, MonoNs now) {
  std::string line = Left(bus.name, 12) + ' ' + Left(bus.StateText(now), 8);
  if (bus.health) {
    const std::string errors = ErrorCounts(bus.health->errors);
    line += ' ' + Right(std::to_string(bus.health->exchanges), 9) + ' ' +
            Right(Decimal(bus.health->rate_hz, 1), 8) + ' ' + Right(Decimal(bus.health->wire_limit_hz, 0), 6) +
            ' ' + Right(std::to_string(bus.health->late), 6) + "  " + (errors.empty() ? "none" : errors);
  }
  return line + '\n';
}

std::string Indented(const std::vector<std::string>& texts) {
  std::string rows;
  for (const std::string& text : texts) rows += "  " + Printable(text) + '\n';
  return rows;
}

// Formats the lost messages, and the faults or `good`.
std::string EndText(const MachineView& machine, const std::vector<std::string>& faults, const char* good) {
  std::string text = machine.ReceptionLoss();
  if (!text.empty()) text += '\n';
  if (faults.empty()) return text + good;
  return text + "not good:\n" + Indented(faults);
}

std::string Text(const MachineView& machine, const std::vector<std::string>& faults, MonoNs now, double seconds) {
  std::string text = "ran " + Decimal(seconds, 1) + " s\n";
  text += "DEVICE       STATE     READINGS       /s   LOST          LAST VALUE ALARMS SEEN\n";
  for (const DeviceView& device : machine.devices()) text += DeviceText(device, now, seconds);
  text += "BUS          STATE    EXCHANGES       /s   WIRE   LATE  ERRORS\n";
  for (const BusView& bus : machine.buses()) text += BusText(bus, now);
  return text +
         EndText(machine, faults, "good: every device ONLINE, every bus UP, nothing lost, no process failed\n");
}

// Counts of LCM datagrams that this process lost or refused.
Json ReceptionJson(const ReceptionCounts& counts) {
  Json machines = Json::array();
  for (const OtherMachine& machine : counts.machines) machines.push_back(machine.name);
  return {{"dropped", counts.dropped},
          {"outside", counts.outside},
          {"malformed", counts.malformed},
          {"other_machines", std::move(machines)},
          {"network", counts.network}};
}

// "; UTC +-0.020 ms from 10.0.0.1 (chrony)", or no text if nothing is claimed of UTC.
std::string UtcText(const time_quality_t& quality) {
  if (quality.utc_half_width_ns < 0) return "";
  const std::string reference = quality.utc_reference.empty() ? "" : " from " + Printable(quality.utc_reference);
  return "; UTC +-" + Decimal(static_cast<double>(quality.utc_half_width_ns) * 1e-6, 3) + " ms" + reference +
         (quality.utc_source == time_quality_t::SOURCE_PTP ? " (PTP, time: ptp_bound_us)" : " (chrony)");
}

// "cell2                    time      +-0.312 ms of plc1; UTC +-0.020 ms from 10.0.0.1 (chrony)".
std::string HostRow(const HostView& host, MonoNs now) {
  const time_quality_t& quality = host.quality;
  std::string claim = "no claim: " + Printable(quality.reason);
  if (!host.State(now)) {
    claim = "silent";
  } else if (quality.source == time_quality_t::SOURCE_SELF && host.Claims(now)) {
    claim = "root of the time base";
  } else if (host.Claims(now)) {
    claim =
        "+-" + Decimal(static_cast<double>(quality.half_width_ns) * 1e-6, 3) + " ms of " + Printable(quality.root);
  }
  if (host.State(now)) claim += UtcText(quality);
  return Left(host.name, 24) + " time      " + claim + '\n';
}

Json TimeJson(const MachineView& machine, MonoNs now) {
  Json json = {{"root", machine.time_root()}, {"hosts", Json::array()}};
  for (const HostView& host : machine.hosts()) {
    Json entry = {{"fresh", host.State(now).has_value()}, {"claims", host.Claims(now)}};
    entry.update(ToJson(host.quality));
    json["hosts"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace

std::string StatusText(const MachineView& machine, MonoNs now, StatusRows rows) {
  const bool hides_good = rows == StatusRows::kByNumber && machine.devices().size() > kMaxGoodRows;
  std::string text;
  if (machine.allows_unsigned()) text += "warning: " + std::string(kUnsignedWarning) + '\n';
  if (hides_good || rows == StatusRows::kAll) text += CountsText(CountParts(machine, now));
  for (const DeviceView& device : machine.devices()) {
    if (!hides_good || NeedsAttention(device, now)) text += DeviceRows(device, now);
  }
  for (const BusView& bus : machine.buses()) {
    if (!hides_good || !bus.Up(now)) text += BusRow(bus, now);
  }
  for (const HostView& host : machine.hosts()) {
    if (!hides_good || !host.Claims(now)) text += HostRow(host, now);
  }
  text += BridgeRows(machine.bridge(), now);
  const std::vector<std::string> faults = MachineFaults(machine, now);
  if (!hides_good || faults.empty()) return text + EndText(machine, faults, kGoodText);
  // The rows above are the causes of the devices and buses.
  const std::vector<std::string> common = CommonFaults(machine, now);
  if (common.size() == faults.size()) return text + EndText(machine, common, kGoodText);
  return text + EndText(machine, {}, "not good: devices or buses as above\n") + Indented(common);
}

Json StatusJson(const MachineView& machine, MonoNs now) {
  Json json;
  json["machine"] = machine.machine();
  json["all_online"] = machine.AllOnline(now);
  const std::vector<std::string> faults = MachineFaults(machine, now);
  json["good"] = faults.empty();
  json["faults"] = faults;
  json["warnings"] = Json::array();
  if (machine.allows_unsigned()) json["warnings"].push_back(kUnsignedWarning);
  json["counts"] = CountsJson(CountParts(machine, now));
  json["devices"] = Json::array();
  for (const DeviceView& device : machine.devices()) {
    Json entry = {{"device", device.name},
                  {"bus", device.bus},
                  {"heard", device.info.has_value()},
                  {"online", device.Online(now)}};
    if (device.info) entry.update(ToJson(*device.info));
    if (device.motor) entry["motor"] = ToJson(*device.motor);
    if (!device.has_position) AddLimits(device, entry);
    json["devices"].push_back(std::move(entry));
  }
  json["buses"] = Json::array();
  for (const BusView& bus : machine.buses()) {
    Json entry = {{"bus", bus.name}, {"heard", bus.health.has_value()}, {"up", bus.Up(now)}};
    if (bus.health) entry.update(ToJson(*bus.health));
    json["buses"].push_back(std::move(entry));
  }
  if (!machine.time_root().empty() || !machine.hosts().empty()) json["time"] = TimeJson(machine, now);
  json["reception"] = ReceptionJson(machine.reception());
  json["bridge"] = {{"serves", machine.bridge().Fresh(now)}, {"alarms", AlarmsJson(machine.bridge().entries())}};
  return json;
}

std::string InfoText(const DeviceView& device, MonoNs now) {
  const device_info_t& info = *device.info;
  std::string operations;
  for (const std::string& operation : info.operations) operations += (operations.empty() ? "" : " ") + operation;
  const std::string errors = ErrorCounts(info.errors);
  const auto or_none = [](const std::string& text) { return text.empty() ? std::string("-") : Printable(text); };
  return Row("device", device.name + " on " + device.bus) +
         Row("state", device.StateText(now) + (info.reason.empty() ? "" : " (" + Printable(info.reason) + ")")) +
         (device.has_position ? PositionRows(device) : MotorRows(device)) + AlarmRows(device) +
         Row("model", Printable(info.family + ' ' + info.model)) + Row("serial", or_none(info.serial)) +
         Row("firmware", or_none(info.firmware)) +
         (info.product_code.empty() ? "" : Row("product code", Printable(info.product_code))) +
         Row("identity", info.identity < 0 ? "-" : std::to_string(info.identity)) +
         (device.has_position ? ScaleRows(info) : "") + Row("poll", Period(info.poll_us)) +
         Row("publish", "at most " + Period(info.publish_us)) +
         Row("stale after", std::to_string(info.max_age_us) + " us") + Row("good", std::to_string(info.good)) +
         Row("errors", errors.empty() ? "none" : errors) +
         Row("memory writes", std::to_string(info.nv_writes) + " since its driver started") +
         Row("operations", Printable(operations));
}

Json InfoJson(const DeviceView& device) {
  Json json;
  json["device"] = ToJson(*device.info);
  if (device.has_position) {
    json["position"] = device.position ? ToJson(*device.position) : Json(nullptr);
  } else {
    json["motor"] = device.motor ? ToJson(*device.motor) : Json(nullptr);
    AddLimits(device, json);
  }
  json["alarms"] = AlarmsJson(device.alarms.entries());
  return json;
}

std::vector<std::string> RenderTable(const MachineView& machine, MonoNs now, MonoNs running,
                                     const std::deque<std::string>& events) {
  const std::string title = "axlecast " + Printable(machine.machine()) + "  " + ClockTime(running) + "  " +
                            std::to_string(machine.online(now)) + " of " +
                            std::to_string(machine.devices().size()) + " devices online";
  std::vector<std::string> lines;
  lines.push_back(Left(title, kTableWidth - 12) + " Ctrl-C ends");
  lines.emplace_back();
  AddDevices(machine, now, lines);
  lines.emplace_back("BUS          STATE     EXCHANGES OF WIRE LIMIT p50 us   p99       GOOD    LATE");
  for (const BusView& bus : machine.buses()) AddBus(bus, now, lines);
  if (!events.empty()) {
    lines.emplace_back();
    for (const std::string& event : events) AddEvent(event, lines);
  }
  return lines;
}

std::string RenderLine(const MachineView& machine, MonoNs now, MonoNs running) {
  double hz = 0;
  std::int64_t lost = 0;
  for (const DeviceView& device : machine.devices()) {
    hz += device.reading_hz;
    lost += device.readings.lost();
  }
  return ClockTime(running) + "  " + std::to_string(machine.online(now)) + " of " +
         std::to_string(machine.devices().size()) + " devices online, " + Decimal(hz, 0) + " readings/s, " +
         std::to_string(lost) + " lost";
}

RunSummary Summarize(const MachineView& machine, const std::vector<std::string>& deaths, MonoNs now,
                     MonoNs running) {
  const double seconds = static_cast<double>(running) / 1e9;
  RunSummary summary;
  summary.faults = MachineFaults(machine, now);
  for (const DeviceView& device : machine.devices()) AddFaults(device, summary.faults);
  summary.faults.insert(summary.faults.end(), deaths.begin(), deaths.end());

  Json json;
  json["machine"] = machine.machine();
  json["good"] = summary.Good();
  json["seconds"] = seconds;
  json["devices"] = Json::array();
  for (const DeviceView& device : machine.devices()) json["devices"].push_back(DeviceJson(device, now, seconds));
  json["buses"] = Json::array();
  for (const BusView& bus : machine.buses()) json["buses"].push_back(BusJson(bus, now));
  json["reception"] = ReceptionJson(machine.reception());
  json["deaths"] = deaths;
  json["faults"] = summary.faults;
  summary.json = JsonLine(json);
  summary.text = Text(machine, summary.faults, now, seconds);
  return summary;
}

}  // namespace axlecast
