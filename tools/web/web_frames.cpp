#include "tools/web/web_frames.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <map>
#include <numbers>

#include "core/config/hosts.h"
#include "core/device/reading.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "core/messages/json/number_list.h"
#include "tools/monitor/trip_margins.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

const DeviceConfig* ConfigOf(const MachineConfig& machine, std::string_view name) {
  const BusConfig* bus = machine.BusOf(name);
  if (bus == nullptr) return nullptr;
  for (const DeviceConfig& device : bus->devices) {
    if (device.name == name) return &device;
  }
  return nullptr;
}

Json ColumnsJson(const std::vector<WebColumn>& columns) {
  Json json = Json::array();
  for (const WebColumn& column : columns) json.push_back({{"name", column.name}, {"unit", column.unit}});
  return json;
}

Json HelloDevice(const DeviceView& device, const MachineConfig& machine) {
  const DeviceConfig* config = ConfigOf(machine, device.name);
  const BusConfig* bus = machine.FindBus(device.bus);
  const device_info_t* info = device.info ? &*device.info : nullptr;
  const std::int8_t unit = config != nullptr ? config->unit : info != nullptr ? info->unit : std::int8_t{0};
  const std::string family = bus != nullptr && bus->family != nullptr ? std::string(bus->family->name)
                             : info != nullptr                        ? info->family
                                                                      : "";
  const double per_turn = config != nullptr ? config->per_turn : info != nullptr ? info->per_turn : NAN;
  return {{"device", device.name},
          {"bus", device.bus},
          {"family", family},
          {"model", config != nullptr ? config->model
                    : info != nullptr ? info->model
                                      : ""},
          {"kind", device.has_position ? "position" : "motor"},
          {"unit", device.has_position ? Json(UnitName(unit)) : Json(nullptr)},
          {"per_turn", device.has_position ? Field(per_turn) : Json(nullptr)},
          {"columns", ColumnsJson(ColumnsOf(device, unit))}};
}

using DevicesOfBuses = std::map<std::string_view, std::vector<std::string_view>>;

DevicesOfBuses GroupByBus(const MachineView& machine) {
  DevicesOfBuses devices;
  for (const DeviceView& device : machine.devices()) devices[device.bus].push_back(device.name);
  return devices;
}

Json HelloBus(const BusView& bus, const DevicesOfBuses& devices_of, const MachineConfig& machine) {
  const BusConfig* config = machine.FindBus(bus.name);
  const auto found = devices_of.find(bus.name);
  Json devices = found != devices_of.end() ? Json(found->second) : Json::array();
  const bool known = config != nullptr && config->family != nullptr;
  const HostConfig* host = HostOfBus(machine.hosts, bus.name);
  return {{"bus", bus.name},
          {"family", known        ? std::string(config->family->name)
                     : bus.health ? bus.health->family
                                  : ""},
          {"port", config != nullptr ? config->link.port
                   : bus.health      ? bus.health->port
                                     : ""},
          {"simulated", config != nullptr && config->simulate},
          {"host", host != nullptr ? Json(host->name) : Json(nullptr)},
          {"devices", std::move(devices)}};
}

// ---- state ----

Json HeardUtime(MonoNs at, WebTimestamp now) {
  return at == 0 ? Json(nullptr) : Json(now.utime - (now.mono - at) / kMicrosecond);
}

Json NullIfZero(std::int64_t value) { return value == 0 ? Json(nullptr) : Json(value); }
Json NullIfNegative(std::int64_t value) { return value < 0 ? Json(nullptr) : Json(value); }

// Returns these members of a message.
Json Members(const Json& message, std::initializer_list<const char*> keys) {
  Json json = Json::object();
  for (const char* key : keys) json[key] = message.at(key);
  return json;
}

// Splits a list at its commas.
Json WordsOf(std::string_view names) {
  Json json = Json::array();
  while (!names.empty()) {
    const std::size_t end = std::min(names.find(','), names.size());
    json.push_back(names.substr(0, end));
    names.remove_prefix(std::min(end + 1, names.size()));
    while (names.starts_with(' ')) names.remove_prefix(1);
  }
  return json;
}

Json ErrorsJson(const std::int64_t (&errors)[16]) {
  Json json = Json::object();
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
    if (errors[kind] != 0) json[ErrorName(static_cast<ErrorKind>(kind))] = errors[kind];
  }
  return json;
}

Json PositionJson(const DeviceView& device) {
  const position_t& position = *device.position;
  const bool valid = (position.flags & position_t::FLAG_VALID) != 0;
  const auto or_null = [valid](double value) { return valid ? Field(value) : Json(nullptr); };
  const double turns = position.counts_per_turn > 0
                           ? static_cast<double>(position.counts) / static_cast<double>(position.counts_per_turn)
                           : NAN;
  Json json = {{"valid", valid},
               {"flags", WordsOf(FlagNames(position.flags))},
               {"value", or_null(position.value)},
               {"unit", UnitName(position.unit)},
               {"turns", or_null(turns)},
               {"angle_deg", or_null(position.angle_rad * 180 / std::numbers::pi)},
               {"speed_rpm", Field(device.SpeedRpm())}};
  json.update(Members(ToJson(position), {"raw_counts", "raw_turns", "counts", "datum_epoch", "device_status"}));
  return json;
}

Json MotorFlags(std::int32_t flags) {
  static constexpr std::array<std::string_view, 5> kNames = {"analog_valid", "status_valid", "tripped", "simulated",
                                                             "redecoded"};
  Json json = Json::array();
  for (std::size_t bit = 0; bit < kNames.size(); ++bit) {
    if ((flags >> bit & 1) != 0) json.push_back(kNames.at(bit));
  }
  return json;
}

Json MotorJson(const motor_health_t& motor) {
  const auto has = [&motor](std::int32_t flag) { return (motor.flags & flag) != 0; };
  Json factors = Json::array();
  for (const std::int32_t bits : motor.trip_factor) factors.push_back(WordsOf(MotorStatusNames(bits)));
  Json json = {{"valid", has(motor_health_t::FLAG_ANALOG_VALID) && has(motor_health_t::FLAG_STATUS_VALID)},
               {"flags", MotorFlags(motor.flags)},
               {"tripped", has(motor_health_t::FLAG_TRIPPED)},
               {"status", WordsOf(MotorStatusNames(motor.status_bits))},
               {"trip_factors", std::move(factors)},
               {"stop_coil", NullIfNegative(motor.stop_coil)},
               {"logged_in", NullIfNegative(motor.logged_in)},
               {"mains_hz", NullIfZero(motor.mains_hz)}};
  json.update(Members(ToJson(motor), {"voltage_v", "current_a", "power_w", "temperature_c", "accel_mps2",
                                      "trip_count", "status_names", "trip_factor_names"}));
  return json;
}

// Returns the trip limits of a motor, with the margins of its reading; null until LIMITS was received.
Json LimitsJson(const DeviceView& device, WebTimestamp now) {
  if (!device.limits) return nullptr;
  return {{"utime", device.limits->utime},
          {"heard_utime", HeardUtime(device.limits_at, now)},
          {"margins", MarginsJson(TripMargins(device.motor.value_or(motor_health_t{}), *device.limits))}};
}

Json ReadingJson(const DeviceView& device, WebTimestamp now) {
  if (device.has_position ? !device.position : !device.motor) return nullptr;
  const std::int64_t age_us = std::max<MonoNs>(now.mono - device.reading_at, 0) / kMicrosecond;
  const bool silent = !device.State(now.mono);
  const bool old = device.info && device.info->max_age_us > 0 && age_us > device.info->max_age_us;
  Json json = {{"utime", device.has_position ? device.position->utime : device.motor->utime},
               {"age_us", age_us},
               {"stale", silent || old}};
  json.update(device.has_position ? PositionJson(device) : MotorJson(*device.motor));
  return json;
}

Json WorstAlarm(const AlarmView& alarms) {
  std::optional<std::int8_t> worst;
  for (const alarm_entry_t& entry : alarms.entries())
    worst = std::max(worst.value_or(entry.severity), entry.severity);
  return worst ? Json(SeverityName(*worst)) : Json(nullptr);
}

Json InfoPart(const device_info_t& info) {
  Json json = Members(ToJson(info), {"model", "serial", "firmware", "product_code", "good", "poll_us", "publish_us",
                                     "max_age_us", "counts_per_turn", "turns_range", "nv_writes"});
  json.update({{"identity", NullIfNegative(info.identity)},
               {"errors", ErrorsJson(info.errors)},
               {"reference_lost", info.reference_lost != 0},
               {"direction", info.direction > 0 ? "ccw" : "cw"},
               {"last_good_utime", NullIfZero(info.last_good_utime)}});
  return json;
}

Json DeviceJson(const DeviceView& device, WebTimestamp now) {
  const auto state = device.State(now.mono);
  Json json = {{"device", device.name},
               {"state", state ? Json(DeviceStateName(*state)) : Json(nullptr)},
               {"reason", device.info ? device.info->reason : ""},
               {"heard_utime", HeardUtime(device.info_at, now)},
               {"reading", ReadingJson(device, now)},
               {"rate_hz", Field(device.reading_hz)},
               {"lost", device.readings.lost()},
               {"alarms", device.alarms.total()},
               {"worst", WorstAlarm(device.alarms)}};
  if (!device.has_position) json["limits"] = LimitsJson(device, now);
  if (device.info) json.update(InfoPart(*device.info));
  return json;
}

Json BusJson(const BusView& bus, WebTimestamp now) {
  const auto state = bus.State(now.mono);
  Json json = {{"bus", bus.name},
               {"state", state ? Json(BusStateName(*state)) : Json(nullptr)},
               {"heard_utime", HeardUtime(bus.health_at, now)}};
  if (!bus.health) return json;
  const bus_health_t& health = *bus.health;
  json.update(Members(ToJson(health), {"exchanges", "good", "late", "rx_dropped", "rate_hz", "wire_limit_hz",
                                       "utilisation", "reopens", "last_error"}));
  json.update({{"errors", ErrorsJson(health.errors)},
               {"exchange_us",
                {{"min", Field(health.exchange_us[0])},
                 {"p50", Field(health.exchange_us[1])},
                 {"p99", Field(health.exchange_us[2])},
                 {"max", Field(health.exchange_us[3])}}},
               {"can_tec", NullIfNegative(health.can_tec)},
               {"can_rec", NullIfNegative(health.can_rec)},
               {"last_error_utime", NullIfZero(health.last_error_utime)}});
  return json;
}

Json RecorderJson(const RecorderView& recorder, WebTimestamp now) {
  static constexpr std::array<std::string_view, 5> kStates = {"RECORDING", "PRE_TRIGGER", "DISK_FULL", "ERROR",
                                                              "STOPPING"};
  const auto state = recorder.State(now.mono);
  const bool known = state && *state >= 0 && static_cast<std::size_t>(*state) < kStates.size();
  Json json = {{"recorder", recorder.name},
               {"state", known                      ? Json(kStates.at(static_cast<std::size_t>(*state)))
                         : state                    ? Json("?")
                         : recorder.Ended(now.mono) ? Json("ENDED")
                                                    : Json(nullptr)},
               {"heard_utime", HeardUtime(recorder.health_at, now)}};
  if (!recorder.health) return json;
  const recorder_health_t& health = *recorder.health;
  json.update(Members(ToJson(health), {"file", "file_bytes", "total_bytes", "messages", "lost", "kernel_dropped",
                                       "free_bytes", "messages_hz", "bytes_hz", "senders", "last_error"}));
  json["last_error_utime"] = NullIfZero(health.last_error_utime);
  return json;
}

template <typename Views, typename Describe>
Json ListOf(const Views& views, const Describe& describe, WebTimestamp now) {
  Json json = Json::array();
  for (const auto& view : views) json.push_back(describe(view, now));
  return json;
}

}  // namespace

std::vector<WebColumn> ColumnsOf(const DeviceView& device, std::int8_t unit) {
  if (device.has_position) {
    return {{"value", std::string(UnitName(unit))}, {"turns", "turn"}, {"speed_rpm", "rpm"}};
  }
  return {{"voltage_v", "V"},       {"current_a", "A"},       {"power_w", "W"},        {"temperature_c", "°C"},
          {"accel_x_mps2", "m/s²"}, {"accel_y_mps2", "m/s²"}, {"accel_z_mps2", "m/s²"}};
}

std::string HelloFrame(const Monitor& monitor, const MachineConfig& machine, std::string_view version,
                       const std::optional<WebLogFacts>& log, WebFleet fleet) {
  const char* const mode = log ? "log" : fleet == WebFleet::kOnly ? "fleet" : "live";
  Json json = {{"type", "hello"},  {"version", version}, {"machine", machine.machine},       {"mode", mode},
               {"history_s", 300}, {"log", nullptr},     {"fleet", fleet != WebFleet::kNone}};
  if (log) {
    json["log"] = {{"files", log->files}, {"first_utime", log->first_utime}, {"last_utime", log->last_utime}};
  }
  json["buses"] = Json::array();
  const DevicesOfBuses devices_of = GroupByBus(monitor.machine());
  for (const BusView& bus : monitor.machine().buses()) json["buses"].push_back(HelloBus(bus, devices_of, machine));
  json["devices"] = Json::array();
  for (const DeviceView& device : monitor.machine().devices()) {
    json["devices"].push_back(HelloDevice(device, machine));
  }
  return JsonLine(json);
}

std::string StateFrame(const Monitor& monitor, WebTimestamp now) {
  const ReceptionCounts& reception = monitor.machine().reception();
  return JsonLine({{"type", "state"},
                   {"utime", now.utime},
                   {"devices", ListOf(monitor.machine().devices(), DeviceJson, now)},
                   {"buses", ListOf(monitor.machine().buses(), BusJson, now)},
                   {"recorders", ListOf(monitor.recorders(), RecorderJson, now)},
                   {"bridge", {{"serves", monitor.machine().bridge().Fresh(now.mono)}}},
                   {"reception",
                    {{"dropped", reception.dropped},
                     {"outside", reception.outside},
                     {"malformed", reception.malformed},
                     {"network", reception.network},
                     {"turned_away", monitor.machine().turned_away()}}}});
}

std::string AlarmsFrame(std::string_view device, const AlarmView& alarms, std::int64_t utime,
                        const std::set<std::string>& before) {
  static constexpr std::array<std::string_view, 7> kSources = {"device",   "driver", "bus", "bridge",
                                                               "recorder", "mqtt",   "ship"};
  Json entries = Json::array();
  Json appeared = Json::array();
  std::set<std::string> gone = before;
  for (const alarm_entry_t& entry : alarms.entries()) {
    const std::size_t source = static_cast<std::uint8_t>(entry.source);
    Json json = Members(ToJson(entry), {"name", "code", "first_utime", "last_utime", "count", "action"});
    json["source"] = source < kSources.size() ? kSources.at(source) : "?";
    json["severity"] = SeverityName(entry.severity);
    json["state"] = AlarmStateName(entry.state);
    entries.push_back(std::move(json));
    if (gone.erase(entry.name) == 0 && !before.contains(entry.name)) appeared.push_back(entry.name);
  }
  return JsonLine({{"type", "alarms"},
                   {"device", device},
                   {"utime", utime},
                   {"total", alarms.total()},
                   {"entries", std::move(entries)},
                   {"appeared", std::move(appeared)},
                   {"cleared", gone}});
}

std::string TripFrame(const trip_log_t& trip) {
  Json factors = Json::array();
  for (std::uint32_t bit = 0; bit < 32; ++bit) {
    const auto mask = static_cast<std::int32_t>(1U << bit);
    if ((trip.factor_bits & mask) != 0) factors.push_back(MotorStatusNames(mask));
  }
  DeviceView motor;
  motor.has_position = false;
  Json samples = Json::array();
  for (std::size_t i = 0; i < std::size(trip.samples); ++i) {
    samples.push_back((trip.valid_mask >> i & 1) != 0 ? Field(trip.samples[i]) : Json(nullptr));
  }
  return JsonLine({{"type", "trip"},
                   {"device", trip.device},
                   {"utime", trip.utime},
                   {"log_index", trip.log_index},
                   {"trip_count", trip.trip_count},
                   {"factors", std::move(factors)},
                   {"factor_names", ToJson(trip).at("factor_names")},
                   {"not_before_utime", NullIfZero(trip.not_before_utime)},
                   {"not_after_utime", NullIfZero(trip.not_after_utime)},
                   {"interval_us", trip.interval_us},
                   {"quantities", ColumnsJson(ColumnsOf(motor, 0))},
                   {"samples", std::move(samples)}});
}

std::string CommandFrame(const command_status_t& status) {
  return JsonLine({{"type", "command"},
                   {"id", HexDigits(Bytes(status.id, std::size(status.id)))},
                   {"utime", status.utime},
                   {"device", status.device},
                   {"operation", status.operation},
                   {"state", StateName(status.state)},
                   {"is_final", status.is_final != 0},
                   {"verified", status.verified != 0},
                   {"unsigned", status.is_unsigned != 0},
                   {"reason", status.reason_code == 0 ? "" : ReasonName(status.reason_code)},
                   {"text", status.text},
                   {"started_utime", NullIfZero(status.started_utime)},
                   {"finished_utime", NullIfZero(status.finished_utime)},
                   {"changes", Field(status.changes)}});
}

std::string ErrorFrame(std::string_view text) { return JsonLine({{"type", "error"}, {"text", text}}); }

std::string ResetFrame() { return JsonLine({{"type", "reset"}}); }

std::string PlaybackFrame(const WebPlayback& playback) {
  return JsonLine({{"type", "playback"},
                   {"utime", playback.utime},
                   {"playing", playback.playing},
                   {"speed", playback.speed},
                   {"at_end", playback.at_end},
                   {"seeking", playback.seeking}});
}

std::string TrendFrame(std::string_view device, const std::vector<WebColumn>& columns, const SampleHistory& history,
                       std::int64_t utime) {
  static constexpr std::string_view kColumn = "power_w";
  constexpr std::int64_t kStepUs = 1'000'000;
  const auto named = [](const WebColumn& column) { return column.name == kColumn; };
  const auto column =
      static_cast<std::size_t>(std::find_if(columns.begin(), columns.end(), named) - columns.begin());
  Json times = Json::array();
  Json values = Json::array();
  std::int64_t next = utime - kTrendUs;
  for (std::uint64_t row = history.Find(next); row < history.end(); row = history.Find(next)) {
    times.push_back(history.utime(row));
    values.push_back(Field(history.value(row, column)));
    next = std::max(next, history.utime(row)) + kStepUs;
  }
  return JsonLine({{"type", "trend"},
                   {"device", device},
                   {"column", kColumn},
                   {"utimes", std::move(times)},
                   {"values", std::move(values)}});
}

std::string SamplesFrame(std::string_view device, const std::vector<WebColumn>& columns,
                         const SampleHistory& history, std::uint64_t begin, std::uint64_t end,
                         std::uint64_t dropped) {
  const std::int64_t start = history.utime(begin);
  // A device's name is the only text in it that is not ours.
  std::string text = R"({"type":"samples","device":)" + JsonLine(std::string(device)) + R"(,"t0_utime":)" +
                     std::to_string(start) + R"(,"dt_us":)";
  AppendList(text, begin, end, [&](std::uint64_t row) { text += std::to_string(history.utime(row) - start); });
  text += R"(,"columns":{)";
  for (std::size_t i = 0; i < columns.size(); ++i) {
    text += (i == 0 ? "\"" : ",\"") + std::string(columns[i].name) + "\":";
    AppendList(text, begin, end, [&](std::uint64_t row) { AppendNumber(text, history.value(row, i)); });
  }
  return text + R"(},"dropped":)" + std::to_string(dropped) + '}';
}

}  // namespace axlecast
