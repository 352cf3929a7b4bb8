#include "tools/axlecast/live/run_summary.h"

#include "core/base/text.h"
#include "core/device/reading.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/live/status_text.h"
#include "tools/axlecast/live/table.h"
#include "tools/monitor/machine_faults.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string StateOf(const DeviceView& device, MonoNs now) {
  const auto state = device.State(now);
  return state ? std::string(DeviceStateName(*state)) : "SILENT";
}

std::string StateOf(const BusView& bus, MonoNs now) {
  const auto state = bus.State(now);
  return state ? std::string(BusStateName(*state)) : "SILENT";
}

// Beyond MachineFaults: what the whole run says.
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
  json["state"] = StateOf(device, now);
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
  json["state"] = StateOf(bus, now);
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
  return Left(device.name, 12) + ' ' + Left(StateOf(device, now), 8) + ' ' +
         Right(std::to_string(device.readings.received()), 9) + ' ' + Right(Decimal(Rate(device, seconds), 1), 8) +
         ' ' + Right(std::to_string(device.readings.lost()), 6) + ' ' + Right(ValueText(device), 19) + ' ' +
         (alarms.empty() ? "-" : alarms) + '\n';
}

std::string BusText(const BusView& bus, MonoNs now) {
  std::string line = Left(bus.name, 12) + ' ' + Left(StateOf(bus, now), 8);
  if (bus.health) {
    const std::string errors = ErrorCounts(bus.health->errors);
    line += ' ' + Right(std::to_string(bus.health->exchanges), 9) + ' ' +
            Right(Decimal(bus.health->rate_hz, 1), 8) + ' ' + Right(Decimal(bus.health->wire_limit_hz, 0), 6) +
            ' ' + Right(std::to_string(bus.health->late), 6) + "  " + (errors.empty() ? "none" : errors);
  }
  return line + '\n';
}

std::string Text(const MachineView& machine, const std::vector<std::string>& faults, MonoNs now, double seconds) {
  std::string text = "ran " + Decimal(seconds, 1) + " s\n";
  text += "DEVICE       STATE     READINGS       /s   LOST          LAST VALUE ALARMS SEEN\n";
  for (const DeviceView& device : machine.devices()) text += DeviceText(device, now, seconds);
  text += "BUS          STATE    EXCHANGES       /s   WIRE   LATE  ERRORS\n";
  for (const BusView& bus : machine.buses()) text += BusText(bus, now);
  if (const std::string lost = machine.ReceptionLoss(); !lost.empty()) text += lost + '\n';
  if (faults.empty()) return text + "good: every device ONLINE, every bus UP, nothing lost, no process failed\n";
  text += "not good:\n";
  for (const std::string& fault : faults) text += "  " + Printable(fault) + '\n';
  return text;
}

}  // namespace

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
