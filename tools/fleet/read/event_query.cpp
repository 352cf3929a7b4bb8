#include "tools/fleet/read/event_query.h"

#include <algorithm>
#include <array>

#include "core/base/text.h"

namespace axlecast {
namespace {

using db::Parameter;
using enum ColumnKind;

constexpr EventColumn kAlarmColumns[] = {
    {"device", "e.device", kText},
    {"source", "e.source", kText},
    {"code", "e.code", kInt},
    {"name", "e.name", kText},
    {"severity", "e.severity", kText},
    {"state", "e.state", kText},
    {"alarm_state", "e.alarm_state", kText},
    {"cause", "nullif(e.cause, '')", kText},
    {"text", "e.text", kText},
    {"first_utime", "e.first_utime", kInt},
    {"last_utime", "e.last_utime", kInt},
    {"count", "e.count", kInt},
    {"boot_id", "e.boot_id", kHex},
};
constexpr EventColumn kCommandColumns[] = {
    {"device", "e.device", kText},
    {"command_id", "e.command_id", kUuid},
    {"operation", "e.operation", kText},
    {"state", "e.state", kText},
    {"finding", "nullif(e.finding, '')", kText},
    {"outcome", "e.outcome", kText},
    {"verified", "e.verified", kBool},
    {"reason_code", "e.reason_code", kInt},
    {"reason", "e.reason", kText},
    {"text", "e.text", kText},
    {"issued_by", "e.issued_by", kText},
    {"started_utime", "e.started", kUtime},
    {"finished_utime", "e.finished", kUtime},
};
constexpr EventColumn kTripColumns[] = {
    {"device", "e.device", kText},
    {"trip_count", "e.trip_count", kInt},
    {"factor_bits", "e.factor_bits", kInt},
    {"not_before_utime", "e.not_before", kUtime},
    {"not_after_utime", "e.not_after", kUtime},
    {"interval_us", "e.interval_us", kInt},
};
constexpr EventColumn kDeviceColumns[] = {
    {"device", "e.device", kText},      {"state", "e.state", kText},
    {"reason", "e.reason", kText},      {"bus", "e.bus", kText},
    {"family", "e.family", kText},      {"model", "e.model", kText},
    {"serial", "e.serial", kText},      {"firmware", "e.firmware", kText},
    {"good", "e.good", kInt},           {"errors", "to_json(e.errors)", kList},
    {"nv_writes", "e.nv_writes", kInt}, {"datum_epoch", "e.datum_epoch", kInt},
    {"boot_id", "e.boot_id", kHex},
};
constexpr EventColumn kBusColumns[] = {
    {"bus", "e.bus", kText},
    {"state", "e.state", kText},
    {"family", "e.family", kText},
    {"port", "e.port", kText},
    {"exchanges", "e.exchanges", kInt},
    {"good", "e.good", kInt},
    {"errors", "to_json(e.errors)", kList},
    {"late", "e.late", kInt},
    {"rx_dropped", "e.rx_dropped", kInt},
    {"utilisation", "e.utilisation", kFloat},
    {"boot_id", "e.boot_id", kHex},
};
constexpr EventColumn kRecorderColumns[] = {
    {"recorder", "e.name", kText},
    {"state", "e.state", kText},
    {"messages", "e.messages", kInt},
    {"lost", "e.lost", kInt},
    {"kernel_dropped", "e.kernel_dropped", kInt},
    {"free_bytes", "e.free_bytes", kInt},
    {"boot_id", "e.boot_id", kHex},
};
constexpr EventColumn kMotorColumns[] = {
    {"device", "e.device", kText},
    {"voltage_v", "e.voltage_v", kFloat},
    {"current_a", "e.current_a", kFloat},
    {"power_w", "e.power_w", kFloat},
    {"temperature_c", "e.temperature_c", kFloat},
    {"accel_x_mps2", "e.accel_x_mps2", kFloat},
    {"accel_y_mps2", "e.accel_y_mps2", kFloat},
    {"accel_z_mps2", "e.accel_z_mps2", kFloat},
    {"trip_count", "e.trip_count", kInt},
    {"status_bits", "e.status_bits", kInt},
    {"flags", "e.flags", kInt},
    {"boot_id", "e.boot_id", kHex},
};
constexpr EventColumn kClockColumns[] = {
    {"host", "e.host", kText},
    {"root", "e.root", kText},
    {"state", "e.state", kText},
    {"grade", "e.grade", kText},
    {"base_id", "e.base_id", kHex},
    {"epoch", "e.epoch", kInt},
    {"half_width_ns", "e.half_width_ns", kInt},
    {"utc_half_width_ns", "e.utc_half_width_ns", kInt},
    {"boot_id", "e.boot_id", kHex},
};
constexpr EventColumn kHoleColumns[] = {
    {"until_utime", "e.t1", kUtime}, {"cause", "e.cause", kText},
    {"channel", "e.channel", kText}, {"messages", "e.messages", kInt},
    {"bytes", "e.bytes", kInt},      {"first_event", "e.first_event", kInt},
    {"file", "l.file", kText},       {"noticed_utime", "e.noticed", kUtime},
};
constexpr EventColumn kOddColumns[] = {
    {"channel", "e.channel", kText},        {"cause", "e.cause", kText}, {"message_utime", "e.utime", kInt},
    {"received_utime", "e.received", kInt}, {"file", "l.file", kText},   {"event", "e.event", kInt},
};

constexpr EventTable kTables[] = {
    {"alarms", "axlecast.alarm e", "e.t", "e.device", "e.message", kAlarmColumns},
    {"commands", "axlecast.command e", "e.t", "e.device", "e.message", kCommandColumns},
    {"trips", "axlecast.trip e", "e.t", "e.device", "e.message", kTripColumns},
    {"health", "axlecast.device_health e", "e.t", "e.device", "e.message", kDeviceColumns},
    {"buses", "axlecast.bus_health e", "e.t", "e.bus", "e.message", kBusColumns},
    {"recorders", "axlecast.recorder_health e", "e.t", "e.name", "e.message", kRecorderColumns},
    {"motors", "axlecast.motor_health e", "e.t", "e.device", "e.message", kMotorColumns},
    {"clocks", "axlecast.clock e", "e.t", "e.host", "e.message", kClockColumns},
    {"holes", "axlecast.hole e LEFT JOIN axlecast.log l ON l.id = e.log", "coalesce(e.t0, e.t1, e.noticed)", "", "",
     kHoleColumns},
    {"odd", "axlecast.odd e LEFT JOIN axlecast.log l ON l.id = e.log", "e.noticed", "", "", kOddColumns},
};

void Write(const db::Rows& row, int column, ColumnKind kind, TableWriter& table) {
  if (row.IsNull(0, column)) {
    table.Null();
    return;
  }
  const auto number = [&](const std::optional<std::int64_t>& value) { value ? table.Int(*value) : table.Null(); };
  switch (kind) {
    case kInt:
      return number(row.Int(0, column));
    case kUtime:
      return number(row.Timestamp(0, column));
    case kFloat: {
      const auto value = row.Float(0, column);
      value ? table.Float(*value) : table.Null();
      return;
    }
    case kBool:
      table.Bool(row.Bool(0, column).value_or(false));
      return;
    case kText:
      table.Text(row.Text(0, column));
      return;
    case kHex:
      table.Text(Text("%016llx", static_cast<unsigned long long>(row.Int(0, column).value_or(0))));
      return;
    case kUuid: {
      std::string digits(row.Text(0, column));
      digits.erase(std::remove(digits.begin(), digits.end(), '-'), digits.end());
      table.Text(digits);
      return;
    }
    case kList:
      table.Json(row.Text(0, column));
      return;
  }
}

// $1 machine, $2 from, $3 until, $4 device or NULL, $5 limit or NULL
std::string SqlOf(const EventTable& source, bool message) {
  const std::string time = source.time;
  std::string sql = "SELECT " + time;
  for (const EventColumn& column : source.columns) sql += std::string(", ") + column.sql;
  if (message) sql += std::string(", ") + source.message;
  sql += std::string(" FROM ") + source.table + " WHERE e.machine = $1";
  // A hole and its time end later than they begin.
  sql += source.kind == "holes" ? " AND coalesce(e.t1, e.t0, e.noticed) >= $2" : " AND " + time + " >= $2";
  sql += " AND " + time + " < $3 AND ";
  sql += *source.device == 0 ? "$4::text IS NULL"
                             : "($4::text IS NULL OR " + std::string(source.device) + " = $4::text)";
  return sql + " ORDER BY " + time + " LIMIT $5::int8";
}

}  // namespace

std::span<const EventTable> EventTables() { return kTables; }

std::vector<std::string> EventColumns(const EventTable& table, bool message) {
  std::vector<std::string> names = {"utime", "utc"};
  for (const EventColumn& column : table.columns) names.emplace_back(column.name);
  if (message) names.emplace_back("message");
  return names;
}

Result<QueryResult> WriteEvents(FleetReader& reader, const FleetMachine& machine, const EventTable& source,
                                const EventQuery& query, TableWriter& table) {
  const std::int64_t before = table.rows();
  const auto done =
      reader.ForEach(SqlOf(source, query.message),
                     {Parameter::Int(machine.id), Parameter::Timestamp(query.times.from.value_or(INT64_MIN)),
                      Parameter::Timestamp(query.times.until.value_or(INT64_MAX)),
                      query.device.empty() ? Parameter::Null() : Parameter::Text(query.device),
                      query.limit > 0 ? Parameter::Int(query.limit) : Parameter::Null()},
                     [&](const db::Rows& row) {
                       const std::optional<std::int64_t> time = row.Timestamp(0, 0);
                       if (time) {
                         table.Int(*time).Utc(*time);
                       } else {
                         table.Null().Null();
                       }
                       int column = 1;
                       for (const EventColumn& shown : source.columns) Write(row, column++, shown.kind, table);
                       if (query.message) table.Json(row.IsNull(0, column) ? "null" : row.Text(0, column));
                       return table.EndRow();
                     });
  if (!done) return Failure(done.error());
  return QueryResult{.rows = table.rows() - before, .damaged = 0, .first_damage = {}};
}

}  // namespace axlecast
