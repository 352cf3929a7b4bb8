#include "tools/axlecast/live/status_text.h"

#include <iterator>
#include <vector>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/live/motor_text.h"
#include "tools/axlecast/live/table.h"
#include "tools/monitor/machine_faults.h"
#include "tools/monitor/trip_margins.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kUnsignedWarning =
    "unsigned commands are obeyed (bridge: unsigned_commands: allow): anybody on the network segment can command "
    "it";

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

}  // namespace

Json ReceptionJson(const ReceptionCounts& counts) {
  return {{"dropped", counts.dropped}, {"outside", counts.outside}, {"malformed", counts.malformed}};
}

std::string StatusText(const MachineView& machine, MonoNs now) {
  std::string text;
  if (machine.allows_unsigned()) text += "warning: " + std::string(kUnsignedWarning) + '\n';
  for (const DeviceView& device : machine.devices()) {
    const auto state = device.State(now);
    const std::string reason = device.info ? Printable(device.info->reason) : "no driver answers";
    text += Left(device.name, 24) + ' ' + Left(state ? DeviceStateName(*state) : "SILENT", 9) + ' ' +
            Right(ValueText(device), 22) + "  " + AlarmText(device, 24) +
            (device.Online(now) || reason.empty() ? "" : "  (" + reason + ")") + '\n';
    if (const std::string margins = MarginsText(device); !margins.empty())
      text += std::string(25, ' ') + margins + '\n';
  }
  for (const BusView& bus : machine.buses()) {
    const auto state = bus.State(now);
    const std::string errors = bus.health ? ErrorCounts(bus.health->errors) : "";
    text += Left(bus.name, 24) + ' ' + Left(state ? BusStateName(*state) : "SILENT", 9) + ' ' +
            (errors.empty() ? "" : "errors: " + errors) +
            (bus.health && !bus.Up(now) ? "  (" + Printable(bus.health->last_error) + ")" : "") + '\n';
  }
  text += BridgeRows(machine.bridge(), now);
  if (const std::string lost = machine.ReceptionLoss(); !lost.empty()) text += lost + '\n';
  const std::vector<std::string> faults = MachineFaults(machine, now);
  if (faults.empty()) return text + "good: every device ONLINE, every bus UP\n";
  text += "not good:\n";
  for (const std::string& fault : faults) text += "  " + Printable(fault) + '\n';
  return text;
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
  json["reception"] = ReceptionJson(machine.reception());
  json["bridge"] = {{"serves", machine.bridge().Fresh(now)}, {"alarms", AlarmsJson(machine.bridge().entries())}};
  return json;
}

std::string InfoText(const DeviceView& device, MonoNs now) {
  const device_info_t& info = *device.info;
  const auto state = device.State(now);
  std::string operations;
  for (const std::string& operation : info.operations) operations += (operations.empty() ? "" : " ") + operation;
  const std::string errors = ErrorCounts(info.errors);
  const auto or_none = [](const std::string& text) { return text.empty() ? std::string("-") : Printable(text); };
  return Row("device", device.name + " on " + device.bus) +
         Row("state", std::string(state ? DeviceStateName(*state) : "SILENT") +
                          (info.reason.empty() ? "" : " (" + Printable(info.reason) + ")")) +
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

std::string PresentText(const DeviceView& device, MonoNs now) {
  if (!device.has_position) {
    if (!device.motor) return device.name + ": present state not known, no MOTOR came";
    return device.name + ": " + MotorQuantities(*device.motor) + "; " + MotorStatusText(*device.motor);
  }
  if (!device.valid) return device.name + ": present position not known, no valid POSITION came";
  std::string text = device.name + " is at " + ValueText(device) + " (" + Decimal(device.Turns(), 4) + " turns, " +
                     Decimal(device.SpeedRpm(), 1) + " rpm), ";
  text += device.Online(now) ? "ONLINE" : "not ONLINE";
  const std::string alarms = AlarmText(device, 60);
  return alarms.empty() ? text : text + ", alarms: " + alarms;
}

std::string UnknownDevice(const MachineConfig& machine, std::string_view name) {
  std::vector<std::string> names;
  for (const BusConfig& bus : machine.buses) {
    for (const DeviceConfig& device : bus.devices) names.push_back(device.name);
  }
  const auto nearest = NearestWord(name, names);
  return "no device " + Quoted(name) + " in " + machine.file + (nearest ? "; did you mean " + *nearest + '?' : "") +
         "\ndevices: " + Listed(names);
}

}  // namespace axlecast
