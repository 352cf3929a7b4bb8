#include "tools/web/web_frames.h"

#include <array>
#include <charconv>
#include <cmath>
#include <iterator>

#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kDigits = 10;  // of a sample: more than any device measures

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

Json HelloBus(const BusView& bus, const Monitor& monitor, const MachineConfig& machine) {
  const BusConfig* config = machine.FindBus(bus.name);
  Json devices = Json::array();
  for (const DeviceView& device : monitor.machine().devices()) {
    if (device.bus == bus.name) devices.push_back(device.name);
  }
  const bool known = config != nullptr && config->family != nullptr;
  return {{"bus", bus.name},
          {"family", known        ? std::string(config->family->name)
                     : bus.health ? bus.health->family
                                  : ""},
          {"port", config != nullptr ? config->link.port
                   : bus.health      ? bus.health->port
                                     : ""},
          {"simulated", config != nullptr && config->simulate},
          {"devices", std::move(devices)}};
}

// Appends the number, or null if it is not finite.
void AppendNumber(std::string& text, double value) {
  if (!std::isfinite(value)) {
    text += "null";
    return;
  }
  std::array<char, 40> digits{};
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, kDigits);
  text.append(digits.data(), end.ptr);
}

template <typename Append>
void AppendList(std::string& text, std::uint64_t begin, std::uint64_t end, const Append& append) {
  text += '[';
  for (std::uint64_t row = begin; row < end; ++row) {
    if (row != begin) text += ',';
    append(row);
  }
  text += ']';
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
                       const std::optional<WebLogFacts>& log) {
  Json json = {
      {"type", "hello"},  {"version", version}, {"machine", machine.machine}, {"mode", log ? "log" : "live"},
      {"history_s", 300}, {"log", nullptr}};
  if (log) {
    json["log"] = {{"files", log->files}, {"first_utime", log->first_utime}, {"last_utime", log->last_utime}};
  }
  json["buses"] = Json::array();
  for (const BusView& bus : monitor.machine().buses()) json["buses"].push_back(HelloBus(bus, monitor, machine));
  json["devices"] = Json::array();
  for (const DeviceView& device : monitor.machine().devices()) {
    json["devices"].push_back(HelloDevice(device, machine));
  }
  return JsonLine(json);
}

std::string AlarmsFrame(std::string_view device, const AlarmView& alarms, std::int64_t utime,
                        const std::set<std::string>& before) {
  static constexpr std::array<std::string_view, 6> kSources = {"device", "driver",   "bus",
                                                               "bridge", "recorder", "mqtt"};
  Json entries = Json::array();
  Json appeared = Json::array();
  std::set<std::string> gone = before;
  for (const alarm_entry_t& entry : alarms.entries()) {
    const std::size_t source = static_cast<std::uint8_t>(entry.source);
    entries.push_back({{"name", entry.name},
                       {"code", entry.code},
                       {"source", source < kSources.size() ? kSources.at(source) : "?"},
                       {"severity", SeverityName(entry.severity)},
                       {"state", AlarmStateName(entry.state)},
                       {"first_utime", entry.first_utime},
                       {"last_utime", entry.last_utime},
                       {"count", entry.count},
                       {"action", entry.action}});
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
                   {"not_before_utime", trip.not_before_utime == 0 ? Json(nullptr) : Json(trip.not_before_utime)},
                   {"not_after_utime", trip.not_after_utime == 0 ? Json(nullptr) : Json(trip.not_after_utime)},
                   {"interval_us", trip.interval_us},
                   {"quantities", ColumnsJson(ColumnsOf(motor, 0))},
                   {"samples", std::move(samples)}});
}

std::string CommandFrame(const command_status_t& status) {
  Json changes = Json::array();
  for (const change_t& change : status.changes) {
    changes.push_back({{"key", change.key}, {"before", change.before}, {"after", change.after}});
  }
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
                   {"started_utime", status.started_utime == 0 ? Json(nullptr) : Json(status.started_utime)},
                   {"finished_utime", status.finished_utime == 0 ? Json(nullptr) : Json(status.finished_utime)},
                   {"changes", std::move(changes)}});
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
