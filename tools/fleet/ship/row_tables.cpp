#include "tools/fleet/ship/row_tables.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/message_json_names.h"

namespace axlecast {
namespace {

using db::CopyRow;
using db::CopyRows;
using Json = nlohmann::json;

constexpr std::int64_t kDayUs = 86'400'000'000;

// Returns the word of the database for a number of a message: "online", "?" for a number that this version does not know.
std::string Word(std::int32_t number, NumberNames names) {
  for (const NumberName& name : names) {
    if (name.number != number) continue;
    std::string word(name.name);
    std::ranges::transform(word, word.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return word;
  }
  return "?";
}

// Appends lo, hi and mean.
void AppendValues(CopyRow& row, const SampleSummary& summary) {
  row.Optional(summary.lo, &CopyRow::Int8)
      .Optional(summary.hi, &CopyRow::Int8)
      .Optional(summary.mean, &CopyRow::Float8);
}

std::int32_t Limited(std::int64_t value) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(value, INT32_MIN, INT32_MAX));
}

TableRows Chunks(const BatchRows& batch, const RowIds& ids) {
  TableRows table{
      "axlecast.position_chunk(t0, t1, seq0, first, last, lo, hi, mean, stream, log, n, valid, missed, flags_or, "
      "flags_and, body)",
      CopyRows(16)};
  for (const PositionChunkRow& chunk : batch.chunks) {
    CopyRow row = table.rows.Row();
    row.Timestamp(chunk.t0).Timestamp(chunk.t1).Int8(chunk.seq0).Int8(chunk.first).Int8(chunk.last);
    AppendValues(row, chunk.summary);
    row.Int4(ids.streams[chunk.stream])
        .Int4(ids.log)
        .Int4(Limited(chunk.summary.n))
        .Int4(Limited(chunk.summary.valid));
    row.Int4(Limited(chunk.summary.missed)).Int4(chunk.summary.flags_or).Int4(chunk.summary.flags_and);
    row.Binary(chunk.body);
  }
  return table;
}

TableRows Devices(const BatchRows& batch, const RowIds& ids) {
  TableRows table{
      "axlecast.device_health(t, boot_id, good, errors, machine, nv_writes, datum_epoch, device, bus, family, "
      "model, serial, firmware, state, reason, message, log, seq)",
      CopyRows(18)};
  for (const DeviceHealthRow& device : batch.devices) {
    CopyRow row = table.rows.Row();
    row.Timestamp(device.t).Int8(device.boot_id).Int8(device.good).Int8Array(device.errors).Int4(ids.machine);
    row.Int4(device.nv_writes).Int4(device.datum_epoch).Text(device.device).Text(device.bus).Text(device.family);
    row.Text(device.model).Text(device.serial).Text(device.firmware);
    row.Text(Word(device.state, kDeviceInfoStateNames)).Text(device.reason).Jsonb(device.message);
    row.Int4(ids.log).Int8(device.seq);
  }
  return table;
}

CopyRow& AppendFloat(CopyRow& row, const std::optional<double>& value) {
  return value ? row.Float4(static_cast<float>(*value)) : row.Null();
}

TableRows Buses(const BatchRows& batch, const RowIds& ids) {
  TableRows table{
      "axlecast.bus_health(t, boot_id, exchanges, good, late, rx_dropped, errors, machine, utilisation, bus, "
      "family, port, state, message, log, seq)",
      CopyRows(16)};
  for (const BusHealthRow& bus : batch.buses) {
    CopyRow row = table.rows.Row();
    row.Timestamp(bus.t).Int8(bus.boot_id).Int8(bus.exchanges).Int8(bus.good).Int8(bus.late).Int8(bus.rx_dropped);
    row.Int8Array(bus.errors).Int4(ids.machine);
    AppendFloat(row, bus.utilisation).Text(bus.bus);
    row.Text(bus.family).Text(bus.port);
    row.Text(Word(bus.state, kBusHealthStateNames)).Jsonb(bus.message).Int4(ids.log).Int8(bus.seq);
  }
  return table;
}

TableRows Recorders(const BatchRows& batch, const RowIds& ids) {
  TableRows table{
      "axlecast.recorder_health(t, boot_id, messages, lost, kernel_dropped, free_bytes, machine, name, state, "
      "message, log, seq)",
      CopyRows(12)};
  for (const RecorderHealthRow& recorder : batch.recorders) {
    CopyRow row = table.rows.Row();
    row.Timestamp(recorder.t).Int8(recorder.boot_id).Int8(recorder.messages).Int8(recorder.lost);
    row.Int8(recorder.kernel_dropped).Int8(recorder.free_bytes).Int4(ids.machine).Text(recorder.recorder);
    row.Text(Word(recorder.state, kRecorderHealthStateNames))
        .Jsonb(recorder.message)
        .Int4(ids.log)
        .Int8(recorder.seq);
  }
  return table;
}

TableRows Motors(const BatchRows& batch, const RowIds& ids) {
  TableRows table{
      "axlecast.motor_health(t, boot_id, machine, voltage_v, current_a, power_w, temperature_c, accel_x_mps2, "
      "accel_y_mps2, accel_z_mps2, trip_count, status_bits, flags, device, message, log, seq)",
      CopyRows(17)};
  for (const MotorHealthRow& motor : batch.motors) {
    CopyRow row = table.rows.Row();
    row.Timestamp(motor.t).Int8(motor.boot_id).Int4(ids.machine);
    for (const auto& value : {motor.voltage_v, motor.current_a, motor.power_w, motor.temperature_c})
      AppendFloat(row, value);
    for (const auto& value : motor.accel_mps2) AppendFloat(row, value);
    row.Int4(motor.trip_count).Int4(motor.status_bits).Int4(motor.flags).Text(motor.device).Jsonb(motor.message);
    row.Int4(ids.log).Int8(motor.seq);
  }
  return table;
}

TableRows Clocks(const BatchRows& batch, const RowIds& ids) {
  TableRows table{
      "axlecast.clock(t, boot_id, base_id, half_width_ns, utc_half_width_ns, machine, epoch, host, root, state, "
      "grade, message, log, seq)",
      CopyRows(14)};
  for (const ClockRow& clock : batch.clocks) {
    CopyRow row = table.rows.Row();
    row.Timestamp(clock.t).Int8(clock.boot_id).Int8(clock.base_id);
    for (const std::int64_t width : {clock.half_width_ns, clock.utc_half_width_ns})
      width < 0 ? row.Null() : row.Int8(width);
    row.Int4(ids.machine).Int4(clock.epoch).Text(clock.host);
    row.Text(clock.root).Text(Word(clock.state, kTimeQualityStateNames));
    row.Text(Word(clock.grade, kTimeQualityGradeNames)).Jsonb(clock.message).Int4(ids.log).Int8(clock.seq);
  }
  return table;
}

TableRows Raw(const BatchRows& batch, const RowIds& ids) {
  TableRows table{"axlecast.raw(t0, t1, first_event, crc32c, log, n, records)", CopyRows(7)};
  for (const RawRow& raw : batch.raw) {
    CopyRow row = table.rows.Row();
    row.Timestamp(raw.t0).Timestamp(raw.t1).Int8(raw.first_event).Int8(raw.crc32c).Int4(ids.log);
    row.Int4(Limited(raw.n)).Binary(raw.records);
  }
  return table;
}

TableRows Odd(const BatchRows& batch, const RowIds& ids) {
  TableRows table{"axlecast.odd(machine, log, event, channel, utime, received, cause, message)", CopyRows(8)};
  for (const OddRow& odd : batch.odd) {
    CopyRow row = table.rows.Row();
    row.Int4(ids.machine).Int4(ids.log).Int8(odd.event).Text(odd.channel).Int8(odd.utime).Int8(odd.received);
    row.Text(odd.cause).Binary(odd.message);
  }
  return table;
}

// ---- statements ----

// Rows travel as one JSON document, so that a statement takes one round trip. $1: the document, $2: machine, $3: log.
RowStatement FromJson(std::string sql, const Json& rows, const RowIds& ids) {
  const std::string text = rows.dump(-1, ' ', false, Json::error_handler_t::replace);
  return {std::move(sql),
          {db::Parameter::Text(text), db::Parameter::Int(ids.machine), db::Parameter::Int(ids.log)}};
}

// A message that is an object of JSON already.
Json Embedded(const std::string& message) { return Json::parse(message, nullptr, false); }

RowStatement Alarms(const BatchRows& batch, const RowIds& ids) {
  Json rows = Json::array();
  for (const AlarmRow& alarm : batch.alarms) {
    rows.push_back({{"t", alarm.t},
                    {"device", alarm.device},
                    {"boot_id", alarm.boot_id},
                    {"code", alarm.code},
                    {"source", Word(alarm.source, kAlarmEntrySourceNames)},
                    {"name", alarm.name},
                    {"severity", Word(alarm.severity, kAlarmEntrySeverityNames)},
                    {"state", AlarmChangeName(alarm.change)},
                    {"alarm_state", Word(alarm.state, kAlarmEntryStateNames)},
                    {"text", alarm.text},
                    {"first_utime", alarm.first_utime},
                    {"last_utime", alarm.last_utime},
                    {"count", alarm.count},
                    {"cause", alarm.cause},
                    {"message", Embedded(alarm.message)}});
  }
  return FromJson(
      "INSERT INTO axlecast.alarm (t, machine, device, boot_id, code, source, name, severity, state, alarm_state, "
      "text, first_utime, last_utime, count, cause, message, log) SELECT timestamptz 'epoch' + r.t * interval '1 "
      "microsecond', $2::int4, r.device, r.boot_id, r.code, r.source, r.name, r.severity, r.state, r.alarm_state, "
      "r.text, r.first_utime, r.last_utime, r.count, r.cause, r.message, $3::int4 FROM "
      "jsonb_to_recordset($1::jsonb) AS r(t int8, device text, boot_id int8, code int4, source text, name text, "
      "severity text, state text, alarm_state text, text text, first_utime int8, last_utime int8, count int4, "
      "cause text, message jsonb) ON CONFLICT DO NOTHING",
      rows, ids);
}

Json TimeOrNull(std::int64_t utime) { return utime == 0 ? Json() : Json(utime); }
Json TextOrNull(const std::string& text) { return text.empty() ? Json() : Json(text); }

RowStatement Commands(const BatchRows& batch, const RowIds& ids) {
  Json rows = Json::array();
  for (const FleetCommandRow& command : batch.commands) {
    const bool issued = command.state.ends_with("issued");
    rows.push_back({{"t", command.t},
                    {"device", command.device},
                    {"command_id", HexDigits(command.id)},
                    {"operation", command.operation},
                    {"state", command.state},
                    {"finding", command.finding},
                    {"is_final", !issued},
                    {"verified", command.verified},
                    {"outcome", issued ? Json() : Json(command.state)},
                    {"reason_code", command.reason_code},
                    {"reason", TextOrNull(command.reason)},
                    {"text", command.text},
                    {"issued_by", TextOrNull(command.issued_by)},
                    {"started", TimeOrNull(command.started_utime)},
                    {"finished", TimeOrNull(command.finished_utime)},
                    {"boot_id", command.boot_id},
                    {"seq", command.seq},
                    {"message", Embedded(command.message)}});
  }
  return FromJson(
      "INSERT INTO axlecast.command (t, machine, device, command_id, operation, state, finding, is_final, "
      "verified, outcome, reason_code, reason, text, issued_by, started, finished, boot_id, seq, message, log) "
      "SELECT timestamptz 'epoch' + r.t * interval '1 microsecond', $2::int4, r.device, r.command_id, "
      "r.operation, r.state, r.finding, r.is_final, r.verified, r.outcome, r.reason_code, r.reason, r.text, "
      "r.issued_by, timestamptz 'epoch' + r.started * interval '1 microsecond', timestamptz 'epoch' + r.finished "
      "* interval '1 microsecond', r.boot_id, r.seq, r.message, $3::int4 FROM jsonb_to_recordset($1::jsonb) AS "
      "r(t int8, device text, command_id uuid, operation text, state text, finding text, is_final bool, verified "
      "bool, outcome text, reason_code int4, reason text, text text, issued_by text, started int8, finished int8, "
      "boot_id int8, seq int8, message jsonb) ON CONFLICT DO NOTHING",
      rows, ids);
}

RowStatement Trips(const BatchRows& batch, const RowIds& ids) {
  Json rows = Json::array();
  for (const TripRow& trip : batch.trips) {
    rows.push_back({{"t", trip.t},
                    {"device", trip.device},
                    {"trip_count", trip.trip_count},
                    {"factor_bits", trip.factor_bits},
                    {"not_before", TimeOrNull(trip.not_before_utime)},
                    {"not_after", TimeOrNull(trip.not_after_utime)},
                    {"interval_us", trip.interval_us},
                    {"key", trip.identity},
                    {"boot_id", trip.boot_id},
                    {"message", Embedded(trip.message)}});
  }
  return FromJson(
      "INSERT INTO axlecast.trip (t, machine, device, trip_count, factor_bits, not_before, not_after, "
      "interval_us, key, boot_id, message, log) SELECT timestamptz 'epoch' + r.t * interval '1 microsecond', "
      "$2::int4, r.device, r.trip_count, r.factor_bits, timestamptz 'epoch' + r.not_before * interval '1 "
      "microsecond', timestamptz 'epoch' + r.not_after * interval '1 microsecond', r.interval_us, r.key, "
      "r.boot_id, r.message, $3::int4 FROM jsonb_to_recordset($1::jsonb) AS r(t int8, device text, trip_count "
      "int4, factor_bits int4, not_before int8, not_after int8, interval_us int4, key int8, boot_id int8, message "
      "jsonb) ON CONFLICT DO NOTHING",
      rows, ids);
}

// The file that the log has, and that it is this log's.
RowStatement MachineFile(const MachineFileRow& file, const RowIds& ids) {
  return {
      "WITH file AS (INSERT INTO axlecast.machine_file (machine, sha256, text, first_seen) VALUES ($1::int4, $2, "
      "$3, $4) ON CONFLICT DO NOTHING) UPDATE axlecast.log SET machine_file = $2 WHERE id = $5::int4",
      {db::Parameter::Int(ids.machine), db::Parameter::Binary(file.sha256), db::Parameter::Text(file.text),
       db::Parameter::Timestamp(file.first_seen), db::Parameter::Int(ids.log)}};
}

RowStatement RollUps(std::string_view table, const std::vector<RollUpRow>& rows, const RowIds& ids) {
  std::vector<std::int64_t> t, n, valid, missed, stream, flags_or, flags_and;
  std::vector<std::optional<std::int64_t>> lo, hi;
  std::vector<std::optional<double>> mean;
  for (const RollUpRow& row : rows) {
    t.push_back(row.t);
    lo.push_back(row.summary.lo);
    hi.push_back(row.summary.hi);
    mean.push_back(row.summary.mean);
    n.push_back(row.summary.n);
    valid.push_back(row.summary.valid);
    missed.push_back(row.summary.missed);
    stream.push_back(ids.streams[row.stream]);
    flags_or.push_back(row.summary.flags_or);
    flags_and.push_back(row.summary.flags_and);
  }
  using db::Parameter;
  return {
      "INSERT INTO " + std::string(table) +
          " AS p (t, lo, hi, mean, n, valid, missed, stream, flags_or, flags_and) SELECT r.t, r.lo, r.hi, r.mean, "
          "r.n, r.valid, r.missed, r.stream, r.flags_or, r.flags_and FROM unnest($1::timestamptz[], $2::int8[], "
          "$3::int8[], $4::float8[], $5::int8[], $6::int8[], $7::int8[], $8::int8[], $9::int8[], $10::int8[]) AS "
          "r(t, lo, hi, mean, n, valid, missed, stream, flags_or, flags_and) ON CONFLICT (stream, t) DO UPDATE "
          "SET lo = least(p.lo, excluded.lo), hi = greatest(p.hi, excluded.hi), mean = CASE WHEN p.valid = 0 THEN "
          "excluded.mean WHEN excluded.valid = 0 THEN p.mean ELSE p.mean + (excluded.mean - p.mean) * "
          "excluded.valid / (p.valid + excluded.valid) END, n = p.n + excluded.n, valid = p.valid + "
          "excluded.valid, missed = least(p.missed + excluded.missed::int8, 2147483647), flags_or = p.flags_or | "
          "excluded.flags_or, flags_and = p.flags_and & excluded.flags_and",
      {Parameter::Timestamps(t), Parameter::Array(lo), Parameter::Array(hi), Parameter::Array(mean),
       Parameter::Array(n), Parameter::Array(valid), Parameter::Array(missed), Parameter::Array(stream),
       Parameter::Array(flags_or), Parameter::Array(flags_and)}};
}

RowStatement Received(const BatchRows& batch, const RowIds& ids) {
  std::vector<std::string> channel;
  std::vector<std::int64_t> boot_id, first_seq, last_seq, t0, t1;
  for (const ReceivedRun& run : batch.received) {
    channel.push_back(run.channel);
    boot_id.push_back(run.boot_id);
    first_seq.push_back(run.first_seq);
    last_seq.push_back(run.last_seq);
    t0.push_back(run.t0);
    t1.push_back(run.t1);
  }
  using db::Parameter;
  return {
      "SELECT axlecast.add_received($1::int4, $2::int4, $3::text[], $4::int8[], $5::int8[], $6::int8[], "
      "$7::timestamptz[], $8::timestamptz[])",
      {Parameter::Int(ids.machine), Parameter::Int(ids.log), Parameter::Array(channel), Parameter::Array(boot_id),
       Parameter::Array(first_seq), Parameter::Array(last_seq), Parameter::Timestamps(t0),
       Parameter::Timestamps(t1)}};
}

}  // namespace

std::vector<TableRows> CopyTables(const BatchRows& batch, const RowIds& ids) {
  std::vector<TableRows> tables;
  const auto add = [&tables](TableRows table) {
    if (!table.rows.empty()) tables.push_back(std::move(table));
  };
  add(Chunks(batch, ids));
  add(Devices(batch, ids));
  add(Buses(batch, ids));
  add(Recorders(batch, ids));
  add(Motors(batch, ids));
  add(Clocks(batch, ids));
  add(Raw(batch, ids));
  add(Odd(batch, ids));
  return tables;
}

std::vector<RowStatement> InsertStatements(const BatchRows& batch, const RowIds& ids) {
  std::vector<RowStatement> statements;
  for (const auto& [table, rows] :
       {std::pair("axlecast.position_second", &batch.seconds), {"axlecast.position_minute", &batch.minutes}}) {
    if (!rows->empty()) statements.push_back(RollUps(table, *rows, ids));
  }
  if (!batch.alarms.empty()) statements.push_back(Alarms(batch, ids));
  if (!batch.commands.empty()) statements.push_back(Commands(batch, ids));
  if (!batch.trips.empty()) statements.push_back(Trips(batch, ids));
  if (!batch.received.empty()) statements.push_back(Received(batch, ids));
  for (const MachineFileRow& file : batch.machine_files) statements.push_back(MachineFile(file, ids));
  return statements;
}

std::set<std::int64_t> DaysOf(const BatchRows& batch) {
  std::set<std::int64_t> days;
  const auto add = [&days](std::int64_t utime) { days.insert((utime >= 0 ? utime : utime - kDayUs + 1) / kDayUs); };
  for (const auto& row : batch.chunks) add(row.t0);
  for (const auto& row : batch.seconds) add(row.t);
  for (const auto& row : batch.minutes) add(row.t);
  for (const auto& row : batch.devices) add(row.t);
  for (const auto& row : batch.buses) add(row.t);
  for (const auto& row : batch.recorders) add(row.t);
  for (const auto& row : batch.motors) add(row.t);
  for (const auto& row : batch.clocks) add(row.t);
  for (const auto& row : batch.raw) add(row.t0);
  return days;
}

std::int64_t EventRows(const BatchRows& batch) {
  return static_cast<std::int64_t>(batch.alarms.size() + batch.commands.size() + batch.trips.size() +
                                   batch.devices.size() + batch.buses.size() + batch.recorders.size() +
                                   batch.motors.size() + batch.clocks.size() + batch.raw.size() + batch.odd.size());
}

}  // namespace axlecast
