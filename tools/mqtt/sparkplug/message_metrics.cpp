#include "tools/mqtt/sparkplug/message_metrics.h"

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <utility>

#include "core/alarm/alarm_codes.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json_names.h"
#include "core/messages/message.h"
#include "tools/mqtt/topics.h"

namespace axlecast {
namespace {

constexpr std::string_view kAlarmPrefix = "Alarm/";
constexpr std::string_view kAlarmSuffix = "/Active";

MetricReading Of(std::string name, bool value) { return {std::move(name), SparkplugType::kBoolean, value}; }
MetricReading Of(std::string name, std::int32_t value) { return {std::move(name), SparkplugType::kInt32, value}; }
MetricReading Of(std::string name, std::int64_t value) { return {std::move(name), SparkplugType::kInt64, value}; }
MetricReading Of(std::string name, std::uint32_t value) { return {std::move(name), SparkplugType::kUInt32, value}; }
// Infinite numbers are null as well.
MetricReading Of(std::string name, double value) {
  return {std::move(name), SparkplugType::kDouble, std::isfinite(value) ? SparkplugValue(value) : SparkplugValue()};
}
MetricReading Of(std::string name, float value) {
  return {std::move(name), SparkplugType::kFloat, std::isfinite(value) ? SparkplugValue(value) : SparkplugValue()};
}
MetricReading Of(std::string name, std::string_view text) {
  return {std::move(name), SparkplugType::kString, MendedUtf8(text)};
}

SparkplugProperty Property(const char* key, std::string_view text) {
  return {key, SparkplugType::kString, MendedUtf8(text)};
}
MetricReading WithUnit(MetricReading reading, std::string_view unit) {
  reading.properties.push_back(Property("engUnit", unit));
  return reading;
}
MetricReading InBirths(MetricReading reading) {
  reading.only_in_births = true;
  return reading;
}
MetricReading TransientText(std::string name, std::string_view json) {
  MetricReading reading = Of(std::move(name), json);
  reading.is_transient = true;
  return reading;
}

MessageMetrics Read(const position_t& m) {
  const auto has = [&m](std::int32_t flag) { return (m.flags & flag) != 0; };
  const bool good = has(position_t::FLAG_VALID) && has(position_t::FLAG_TURNS_VALID);
  MetricReading value = WithUnit(Of("Position/Value", m.value), UnitName(m.unit));
  value.quality = good ? kQualityGood : kQualityBad;
  const double speed = has(position_t::FLAG_SPEED_VALID) ? m.speed_rad_s : std::nan("");
  return {.readings = {std::move(value), Of("Position/Counts", m.counts),
                       Of("Position/Valid", has(position_t::FLAG_VALID)),
                       Of("Position/Referenced", has(position_t::FLAG_REFERENCED)),
                       Of("Position/TurnsValid", has(position_t::FLAG_TURNS_VALID)),
                       WithUnit(Of("Position/Speed", speed), "rad/s"),
                       Of("Position/Flags", static_cast<std::uint32_t>(m.flags)), Of("Position/Seq", m.seq),
                       InBirths(Of("Position/BootId", IdField(m.boot_id).get<std::string>()))}};
}

MessageMetrics Read(const motor_health_t& m) {
  MessageMetrics metrics{.readings = {WithUnit(Of("Motor/Voltage", m.voltage_v), "V"),
                                      WithUnit(Of("Motor/Current", m.current_a), "A"),
                                      WithUnit(Of("Motor/Power", m.power_w), "W"),
                                      WithUnit(Of("Motor/Temperature", m.temperature_c), "degC")}};
  constexpr const char* kAxes[] = {"X", "Y", "Z"};
  for (std::size_t i = 0; i < std::size(kAxes); ++i) {
    metrics.readings.push_back(WithUnit(Of(std::string("Motor/Accel/") + kAxes[i], m.accel_mps2[i]), "m/s2"));
  }
  metrics.readings.push_back(Of("Motor/TripCount", m.trip_count));
  metrics.readings.push_back({"Motor/StopCoil", SparkplugType::kBoolean,
                              m.stop_coil < 0 ? SparkplugValue() : SparkplugValue(m.stop_coil != 0)});
  return metrics;
}

MessageMetrics Read(const device_info_t& m) {
  MessageMetrics metrics{
      .readings = {Of("State", DeviceStateName(m.state)), Of("State/Code", std::int32_t{m.state}),
                   Of("State/Reason", std::string_view(m.reason)), Of("Model", std::string_view(m.model)),
                   Of("Serial", std::string_view(m.serial)), Of("Firmware", std::string_view(m.firmware)),
                   Of("Datum/Epoch", m.datum_epoch), Of("Reading/Good", m.good)},
      .device_state = m.state};
  for (const NumberName& kind : kDeviceInfoErrorNames) {
    metrics.readings.push_back(Of("Reading/Errors/" + std::string(kind.name), m.errors[kind.number]));
  }
  return metrics;
}

MetricReading AlarmMetric(std::string_view name, std::string_view severity, std::string_view action,
                          SparkplugValue active) {
  MetricReading reading{std::string(kAlarmPrefix) + MendedUtf8(name) + std::string(kAlarmSuffix),
                        SparkplugType::kBoolean, std::move(active)};
  reading.properties = {Property("severity", severity), Property("action", action)};
  return reading;
}

SparkplugValue ActiveOf(std::int8_t state) {
  switch (state) {
    case alarm_entry_t::STATE_LIVE:
    case alarm_entry_t::STATE_DEVICE_LATCHED:
    case alarm_entry_t::STATE_DRIVER_LATCHED:
      return true;
    case alarm_entry_t::STATE_UNACKNOWLEDGED:
    case alarm_entry_t::STATE_SHELVED:
      return false;
    default:
      return {};
  }
}

MessageMetrics Read(const alarm_t& m) {
  MessageMetrics metrics{
      .readings = {Of("Alarm/Total", std::int32_t{m.total}),
                   Of("Alarm/Worst",
                      m.entries.empty() ? std::string_view() : SeverityName(m.entries.front().severity))},
      .is_all_alarms = static_cast<std::size_t>(std::max<std::int16_t>(m.total, 0)) <= m.entries.size()};
  for (const alarm_entry_t& entry : m.entries) {
    metrics.readings.push_back(
        AlarmMetric(entry.name, SeverityName(entry.severity), entry.action, ActiveOf(entry.state)));
  }
  return metrics;
}

MessageMetrics Read(const bus_health_t& m) {
  const std::string base = "Bus/" + MendedUtf8(m.bus);
  return {.readings = {Of(base + "/State", BusStateName(m.state)), Of(base + "/State/Code", std::int32_t{m.state}),
                       Of(base + "/Reopens", m.reopens), Of(base + "/LastError", std::string_view(m.last_error))}};
}

// An event is one text of JSON, as `axlecast mqtt` publishes it without Sparkplug.
std::optional<MessageMetrics> ReadEvent(std::string name, std::string_view type, Bytes bytes) {
  const std::optional<nlohmann::ordered_json> json = MqttPayload(type, bytes);
  const std::optional<MessageHead> head = ReadHead(bytes);
  if (!json || !head) return std::nullopt;
  return MessageMetrics{.timestamp_ms = head->utime / 1'000,
                        .readings = {TransientText(std::move(name), JsonLine(*json))}};
}
constexpr const char* kTrip = "Trip/";
constexpr const char* kCommand = "Command/";
std::optional<MessageMetrics> ReadTrip(Bytes bytes, const std::string& device) {
  return ReadEvent(kTrip + device, "trip_log_t", bytes);
}
std::optional<MessageMetrics> ReadCommand(Bytes bytes, const std::string& device) {
  return ReadEvent(kCommand + device, "command_status_t", bytes);
}

template <typename Message>
std::optional<MessageMetrics> Decoded(Bytes bytes, const std::string& /*name*/) {
  const std::optional<Message> message = DecodeMessage<Message>(bytes);
  if (!message) return std::nullopt;
  MessageMetrics metrics = Read(*message);
  metrics.timestamp_ms = message->utime / 1'000;
  return metrics;
}

// The metrics of a channel belong to the device after the slash, or to the node. Events belong to the node, which is always
// born: a command may end while its device is offline.
struct Kind {
  std::string_view channel;
  bool of_device;
  std::optional<MessageMetrics> (*read)(Bytes message, const std::string& name);
};
constexpr Kind kKinds[] = {{"POSITION/", true, &Decoded<position_t>},
                           {"MOTOR/", true, &Decoded<motor_health_t>},
                           {"DEVICE/", true, &Decoded<device_info_t>},
                           {"ALARM/", true, &Decoded<alarm_t>},
                           {"TRIP/", false, &ReadTrip},
                           {"COMMAND_STATUS/", false, &ReadCommand},
                           {"BUS/", false, &Decoded<bus_health_t>}};

const Kind* KindOf(std::string_view channel) {
  const auto kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                 [channel](const Kind& each) { return channel.starts_with(each.channel); });
  return kind == std::end(kKinds) ? nullptr : kind;
}

// Adds the metrics of a message without their values.
void AddAll(std::vector<MetricReading>& to, const MessageMetrics& from) {
  for (const MetricReading& reading : from.readings) {
    to.push_back(reading);
    to.back().value = {};
  }
}

void AddAlarm(std::vector<MetricReading>& to, const AlarmSpec& alarm) {
  to.push_back(
      AlarmMetric(alarm.name, SeverityName(static_cast<std::int8_t>(alarm.severity)), alarm.action, false));
}

}  // namespace

std::optional<MetricChannel> FindMetricChannel(std::string_view channel) {
  const Kind* kind = KindOf(channel);
  if (kind == nullptr) return std::nullopt;
  return MetricChannel{channel.substr(kind->channel.size()), kind->channel == "BUS/"};
}

std::optional<MessageMetrics> MetricsOf(std::string_view channel, Bytes message) {
  const Kind* kind = KindOf(channel);
  if (kind == nullptr) return std::nullopt;
  const std::string name(channel.substr(kind->channel.size()));
  std::optional<MessageMetrics> metrics = kind->read(message, name);
  if (metrics && kind->of_device) metrics->device = name;
  return metrics;
}

std::vector<MetricReading> DeviceMetrics(const BusConfig& bus, const DeviceConfig& device) {
  using namespace runtime_alarms;
  std::vector<MetricReading> metrics;
  AddAll(metrics, Read(device_info_t{}));
  if (bus.family == nullptr || bus.family->has_position) {
    position_t position{};
    position.unit = device.unit;
    AddAll(metrics, Read(position));
  } else {
    AddAll(metrics, Read(motor_health_t{}));
  }
  AddAll(metrics, Read(alarm_t{}));
  if (bus.family != nullptr && bus.family->alarms != nullptr) {
    for (const AlarmSpec& alarm : bus.family->alarms(device)) AddAlarm(metrics, alarm);
  }
  for (const AlarmSpec* alarm :
       {&kDeviceOffline, &kReferenceLost, &kImplausibleBurst, &kClockStepped, &kPositionJumped, &kTurnsPassedEnd,
        &kUnauthorizedCommand, &kLinkDown, &kDuplicateDriver, &kLateReplies, &kUnexpectedBytes}) {
    AddAlarm(metrics, *alarm);
  }
  if (bus.family == nullptr || bus.family->link != LinkKind::kCan) return metrics;
  for (const AlarmSpec* alarm : {&kCanBusOff, &kCanUnacknowledged, &kCanQueueFull, &kCanBusErrors,
                                 &kCanErrorPassive, &kCanFramesLost, &kCanErrorWarning}) {
    AddAlarm(metrics, *alarm);
  }
  return metrics;
}

std::vector<MetricReading> NodeMetrics(const MachineConfig& machine) {
  std::vector<MetricReading> metrics;
  for (const BusConfig& bus : machine.buses) {
    bus_health_t health{};
    health.bus = bus.name;
    AddAll(metrics, Read(health));
    for (const DeviceConfig& device : bus.devices) {
      const bool has_trips = bus.family != nullptr && !bus.family->has_position;
      if (has_trips) AddAll(metrics, {.readings = {TransientText(kTrip + device.name, "")}});
      AddAll(metrics, {.readings = {TransientText(kCommand + device.name, "")}});
    }
  }
  return metrics;
}

std::vector<MetricReading> AbsentAlarms(const std::vector<MetricReading>& known,
                                        const std::vector<MetricReading>& listed) {
  std::vector<MetricReading> absent;
  for (const MetricReading& metric : known) {
    const bool is_alarm = metric.name.starts_with(kAlarmPrefix) && metric.name.ends_with(kAlarmSuffix);
    const bool is_listed = std::any_of(listed.begin(), listed.end(),
                                       [&metric](const MetricReading& each) { return each.name == metric.name; });
    if (!is_alarm || is_listed) continue;
    absent.push_back(metric);
    absent.back().value = false;
  }
  return absent;
}

}  // namespace axlecast
