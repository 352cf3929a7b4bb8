#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

#include "core/device/reading.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/monitor/trip_margins.h"
#include "tools/web/web_frames.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

Json HeardUtime(MonoNs at, WebTimestamp now) {
  return at == 0 ? Json(nullptr) : Json(now.utime - (now.mono - at) / kMicrosecond);
}

Json UtimeOrNull(std::int64_t utime) { return utime == 0 ? Json(nullptr) : Json(utime); }

// The words of a list with commas between.
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
  return {{"valid", valid},
          {"flags", WordsOf(FlagNames(position.flags))},
          {"value", or_null(position.value)},
          {"unit", UnitName(position.unit)},
          {"turns", or_null(turns)},
          {"angle_deg", or_null(position.angle_rad * 180 / std::numbers::pi)},
          {"speed_rpm", Field(device.SpeedRpm())},
          {"raw_counts", position.raw_counts},
          {"raw_turns", position.raw_turns},
          {"counts", position.counts},
          {"datum_epoch", position.datum_epoch},
          {"device_status", position.device_status}};
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
  const Json message = ToJson(motor);  // has the names of every other JSON of axlecast
  return {{"valid", has(motor_health_t::FLAG_ANALOG_VALID) && has(motor_health_t::FLAG_STATUS_VALID)},
          {"flags", MotorFlags(motor.flags)},
          {"voltage_v", Field(motor.voltage_v)},
          {"current_a", Field(motor.current_a)},
          {"power_w", Field(motor.power_w)},
          {"temperature_c", Field(motor.temperature_c)},
          {"accel_mps2", Field(motor.accel_mps2)},
          {"trip_count", motor.trip_count},
          {"tripped", has(motor_health_t::FLAG_TRIPPED)},
          {"status", WordsOf(MotorStatusNames(motor.status_bits))},
          {"status_names", message.at("status_names")},
          {"trip_factors", std::move(factors)},
          {"trip_factor_names", message.at("trip_factor_names")},
          {"stop_coil", motor.stop_coil < 0 ? Json(nullptr) : Json(motor.stop_coil)},
          {"logged_in", motor.logged_in < 0 ? Json(nullptr) : Json(motor.logged_in)},
          {"mains_hz", motor.mains_hz == 0 ? Json(nullptr) : Json(motor.mains_hz)}};
}

// What trips a motor, beside the reading; null until LIMITS was received.
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
  return {{"model", info.model},
          {"serial", info.serial},
          {"firmware", info.firmware},
          {"product_code", info.product_code},
          {"identity", info.identity < 0 ? Json(nullptr) : Json(info.identity)},
          {"good", info.good},
          {"errors", ErrorsJson(info.errors)},
          {"reference_lost", info.reference_lost != 0},
          {"poll_us", info.poll_us},
          {"publish_us", info.publish_us},
          {"max_age_us", info.max_age_us},
          {"counts_per_turn", info.counts_per_turn},
          {"turns_range", info.turns_range},
          {"direction", info.direction > 0 ? "ccw" : "cw"},
          {"nv_writes", info.nv_writes},
          {"last_good_utime", UtimeOrNull(info.last_good_utime)}};
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
  json.update({{"exchanges", health.exchanges},
               {"good", health.good},
               {"errors", ErrorsJson(health.errors)},
               {"late", health.late},
               {"rx_dropped", health.rx_dropped},
               {"rate_hz", Field(health.rate_hz)},
               {"wire_limit_hz", Field(health.wire_limit_hz)},
               {"utilisation", Field(health.utilisation)},
               {"exchange_us",
                {{"min", Field(health.exchange_us[0])},
                 {"p50", Field(health.exchange_us[1])},
                 {"p99", Field(health.exchange_us[2])},
                 {"max", Field(health.exchange_us[3])}}},
               {"reopens", health.reopens},
               {"can_tec", health.can_tec < 0 ? Json(nullptr) : Json(health.can_tec)},
               {"can_rec", health.can_rec < 0 ? Json(nullptr) : Json(health.can_rec)},
               {"last_error", health.last_error},
               {"last_error_utime", UtimeOrNull(health.last_error_utime)}});
  return json;
}

Json SendersJson(const recorder_health_t& health) {
  Json json = Json::array();
  for (const sender_loss_t& sender : health.senders) {
    json.push_back({{"sender", sender.sender}, {"received", sender.received}, {"lost", sender.lost}});
  }
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
  json.update({{"file", health.file},
               {"file_bytes", health.file_bytes},
               {"total_bytes", health.total_bytes},
               {"messages", health.messages},
               {"lost", health.lost},
               {"kernel_dropped", health.kernel_dropped},
               {"free_bytes", health.free_bytes},
               {"messages_hz", Field(health.messages_hz)},
               {"bytes_hz", Field(health.bytes_hz)},
               {"senders", SendersJson(health)},
               {"last_error", health.last_error},
               {"last_error_utime", UtimeOrNull(health.last_error_utime)}});
  return json;
}

template <typename Views, typename Describe>
Json ListOf(const Views& views, const Describe& describe, WebTimestamp now) {
  Json json = Json::array();
  for (const auto& view : views) json.push_back(describe(view, now));
  return json;
}

}  // namespace

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
                     {"turned_away", monitor.machine().turned_away()}}}});
}

}  // namespace axlecast
