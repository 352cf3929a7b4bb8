#include "tools/web/fleet/fleet_table.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "core/messages/json/field.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;
using Kind = FleetRequest::Kind;

constexpr std::array<FleetColumn, 10> kMachineColumns = {{{"machine", FleetCell::kText},
                                                          {"last_utime", FleetCell::kTime},
                                                          {"lag_us", FleetCell::kInteger},
                                                          {"lag_bytes", FleetCell::kInteger},
                                                          {"worst", FleetCell::kText},
                                                          {"alarms", FleetCell::kInteger},
                                                          {"holes", FleetCell::kInteger},
                                                          {"lost_messages", FleetCell::kInteger},
                                                          {"devices", FleetCell::kInteger},
                                                          {"online", FleetCell::kInteger}}};
constexpr const char* kMachineSql = R"(
SELECT f.machine, f.last_message, (extract(epoch FROM f.lag) * 1000000)::int8, f.lag_bytes, a.worst, a.alarms, f.holes,
  f.lost_messages::int8, f.devices, s.online
FROM axlecast.fleet_status f
CROSS JOIN LATERAL (
  SELECT count(*) AS alarms,
    (ARRAY['critical', 'error', 'warning', 'info'])
      [min(array_position(ARRAY['critical', 'error', 'warning', 'info'], p.severity))] AS worst
  FROM axlecast.present_alarms p WHERE p.machine = f.machine) a
CROSS JOIN LATERAL (SELECT count(*) AS online FROM axlecast.last_state WHERE machine = f.machine AND state = 'online') s
ORDER BY f.machine LIMIT 2001)";

constexpr std::array<FleetColumn, 14> kDeviceColumns = {{{"device", FleetCell::kText},
                                                         {"kind", FleetCell::kText},
                                                         {"utime", FleetCell::kTime},
                                                         {"value", FleetCell::kNumber},
                                                         {"unit", FleetCell::kText},
                                                         {"valid", FleetCell::kBool},
                                                         {"state", FleetCell::kText},
                                                         {"reason", FleetCell::kText},
                                                         {"state_utime", FleetCell::kTime},
                                                         {"bus", FleetCell::kText},
                                                         {"family", FleetCell::kText},
                                                         {"model", FleetCell::kText},
                                                         {"serial", FleetCell::kText},
                                                         {"firmware", FleetCell::kText}}};
constexpr const char* kDeviceSql = R"(
SELECT d.name, CASE WHEN p.t IS NOT NULL THEN 'position' WHEN m.t IS NOT NULL THEN 'motor' END, coalesce(p.t, m.t),
  CASE WHEN p.t IS NULL THEN m.power_w WHEN p.unit_per_count IS NULL THEN p.counts ELSE p.value END,
  CASE WHEN p.t IS NULL THEN 'W' WHEN p.unit_per_count IS NULL THEN 'count' ELSE p.unit END, coalesce(p.valid, m.power_w IS NOT NULL),
  s.state, s.reason, s.t, s.bus, s.family, s.model, s.serial, s.firmware
FROM axlecast.device d JOIN axlecast.machine k ON k.id = d.machine
LEFT JOIN LATERAL (SELECT l.*, a.unit_per_count FROM axlecast.last_position l JOIN axlecast.stream a ON a.id = l.stream
                   WHERE l.machine = k.name AND l.device = d.name) p ON true
LEFT JOIN LATERAL (SELECT t, power_w FROM axlecast.motor_health WHERE machine = k.id AND device = d.name ORDER BY t DESC LIMIT 1) m
  ON true
LEFT JOIN LATERAL (SELECT * FROM axlecast.last_state WHERE machine = k.name AND device = d.name) s ON true
WHERE k.name = $1 ORDER BY d.name LIMIT 1001)";

constexpr std::array<FleetColumn, 9> kAlarmColumns = {{{"utime", FleetCell::kTime},
                                                       {"device", FleetCell::kText},
                                                       {"name", FleetCell::kText},
                                                       {"code", FleetCell::kInteger},
                                                       {"source", FleetCell::kText},
                                                       {"severity", FleetCell::kText},
                                                       {"state", FleetCell::kText},
                                                       {"count", FleetCell::kInteger},
                                                       {"action", FleetCell::kText}}};
constexpr const char* kAlarmSql = R"(
SELECT t, device, name, code, source, severity, state, count, text FROM axlecast.alarm
WHERE machine = (SELECT id FROM axlecast.machine WHERE name = $1) AND t >= $2 AND t < $3
ORDER BY t DESC, device, code LIMIT 501)";

constexpr std::array<FleetColumn, 13> kCommandColumns = {{{"id", FleetCell::kText},
                                                          {"utime", FleetCell::kTime},
                                                          {"device", FleetCell::kText},
                                                          {"operation", FleetCell::kText},
                                                          {"state", FleetCell::kText},
                                                          {"is_final", FleetCell::kBool},
                                                          {"verified", FleetCell::kBool},
                                                          {"unsigned", FleetCell::kBool},
                                                          {"reason", FleetCell::kText},
                                                          {"text", FleetCell::kText},
                                                          {"started_utime", FleetCell::kTime},
                                                          {"finished_utime", FleetCell::kTime},
                                                          {"changes", FleetCell::kJson}}};
// Of a command, its newest state.
constexpr const char* kCommandSql = R"(
SELECT * FROM (
  SELECT DISTINCT ON (command_id) replace(command_id::text, '-', ''), t, device, operation, state, is_final, verified,
    coalesce(message->>'is_unsigned' = '1', false), coalesce(reason, ''), text, started, finished,
    coalesce(message->'changes', '[]')
  FROM axlecast.command
  WHERE machine = (SELECT id FROM axlecast.machine WHERE name = $1) AND t >= $2 AND t < $3
  ORDER BY command_id, is_final DESC, t DESC) newest
ORDER BY t DESC LIMIT 501)";

constexpr std::array<FleetColumn, 1> kTripColumns = {{{"message", FleetCell::kJson}}};
constexpr const char* kTripSql = R"(
SELECT message FROM axlecast.trip
WHERE machine = (SELECT id FROM axlecast.machine WHERE name = $1) AND t >= $2 AND t < $3
ORDER BY t DESC LIMIT 51)";

constexpr FleetTable kMachines = {"fleet_machines", "machines", kMachineSql, 2000, kMachineColumns};
constexpr FleetTable kDevices = {"fleet_devices", "devices", kDeviceSql, 1000, kDeviceColumns};
constexpr FleetTable kAlarms = {"fleet_alarms", "alarms", kAlarmSql, 500, kAlarmColumns};
constexpr FleetTable kCommands = {"fleet_commands", "commands", kCommandSql, 500, kCommandColumns};
constexpr FleetTable kTrips = {"fleet_trips", "trips", kTripSql, 50, kTripColumns};

template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json CellJson(FleetCell cell, const db::Rows& rows, int row, int column) {
  if (rows.IsNull(row, column)) return nullptr;
  switch (cell) {
    case FleetCell::kText:
      return rows.Text(row, column);
    case FleetCell::kInteger:
      return OrNull(rows.Int(row, column));
    case FleetCell::kNumber: {
      const std::optional<double> value = rows.Float(row, column);
      return value ? Field(*value) : Json(nullptr);
    }
    case FleetCell::kBool:
      return OrNull(rows.Bool(row, column));
    case FleetCell::kTime:
      return OrNull(rows.Timestamp(row, column));
    case FleetCell::kJson: {
      Json json = ParseOutsideJson(rows.Text(row, column));
      return json.is_discarded() ? Json(nullptr) : json;
    }
  }
  return nullptr;
}

}  // namespace

const FleetTable& TableOf(Kind kind) {
  switch (kind) {
    case Kind::kMachines:
      return kMachines;
    case Kind::kDevices:
      return kDevices;
    case Kind::kAlarms:
      return kAlarms;
    case Kind::kCommands:
      return kCommands;
    case Kind::kTrips:
    case Kind::kCurve:
      return kTrips;
  }
  return kMachines;
}

db::Parameters TableParameters(const FleetRequest& request) {
  db::Parameters parameters;
  if (request.kind != Kind::kMachines) parameters.push_back(db::Parameter::Text(request.machine));
  if (request.to > 0) {
    parameters.push_back(db::Parameter::Timestamp(request.from));
    parameters.push_back(db::Parameter::Timestamp(request.to));
  }
  return parameters;
}

Json RowJson(std::span<const FleetColumn> columns, const db::Rows& rows, int row) {
  Json json = Json::object();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    json[std::string(columns[i].name)] = CellJson(columns[i].cell, rows, row, static_cast<int>(i));
  }
  return json;
}

std::string TableFrame(const FleetRequest& request, const FleetTable& table, const db::Rows& rows,
                       std::int64_t utime) {
  Json list = Json::array();
  const auto count = static_cast<int>(std::min<std::int64_t>(rows.size(), table.max_rows));
  for (int row = 0; row < count; ++row) list.push_back(RowJson(table.columns, rows, row));
  return JsonLine({{"type", table.type},
                   {"id", request.id},
                   {"utime", utime},
                   {"more", rows.size() > count},
                   {std::string(table.list), std::move(list)}});
}

std::string FleetErrorFrame(const FleetRequest& request, std::string_view text, bool away) {
  return JsonLine({{"type", "fleet_error"}, {"id", request.id}, {"away", away}, {"text", text}});
}

}  // namespace axlecast
