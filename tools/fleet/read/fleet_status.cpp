#include "tools/fleet/read/fleet_status.h"

#include <algorithm>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/base/time.h"
#include "core/base/utc_text.h"

namespace axlecast {
namespace {

using db::Parameter;
using nlohmann::ordered_json;

constexpr std::size_t kTablesShown = 6;

// The rate is the sum of the last whole minute of each device's newest stream.
constexpr const char* kMachines = R"(
SELECT m.name, m.shipper, m.last_utime, m.last_batch, m.lag_bytes, m.lag_logs, h.holes, h.new_holes, o.odd, r.samples, f.free_bytes
FROM axlecast.machine m
LEFT JOIN LATERAL (SELECT count(*) AS holes, count(*) FILTER (WHERE noticed >= now() - $2::int8 * interval '1 microsecond') AS new_holes
                   FROM axlecast.hole WHERE machine = m.id) h ON true
LEFT JOIN (SELECT machine, count(*) AS odd FROM axlecast.odd GROUP BY machine) o ON o.machine = m.id
LEFT JOIN LATERAL (
  SELECT sum(n) AS samples
  FROM axlecast.device d
  CROSS JOIN LATERAL (SELECT id FROM axlecast.stream WHERE device = d.id ORDER BY seen DESC LIMIT 1) s
  JOIN axlecast.position_minute p ON p.stream = s.id
  WHERE d.machine = m.id AND p.t = date_trunc('minute', to_timestamp(m.last_utime / 1e6)) - interval '1 minute') r ON true
LEFT JOIN LATERAL (
  SELECT free_bytes FROM axlecast.recorder_health
  WHERE machine = m.id AND t > to_timestamp(m.last_utime / 1e6) - interval '1 hour' ORDER BY t DESC LIMIT 1) f ON true
WHERE $1::text IS NULL OR m.name = $1::text ORDER BY m.name)";

// A partitioned table with its partitions and indexes.
constexpr const char* kTables = R"(
SELECT c.relname, sum(pg_total_relation_size(p.relid))::int8
FROM pg_class c CROSS JOIN LATERAL pg_partition_tree(c.oid) p
WHERE c.relnamespace = 'axlecast'::regnamespace AND c.relkind = 'p'
GROUP BY 1
UNION ALL
SELECT c.relname, pg_total_relation_size(c.oid)
FROM pg_class c WHERE c.relnamespace = 'axlecast'::regnamespace AND c.relkind = 'r' AND NOT c.relispartition
ORDER BY 2 DESC, 1)";

constexpr const char* kServer =
    "SELECT now(), (SELECT max(version) FROM axlecast.schema_version), pg_database_size(current_database()),"
    " concat_ws('/', (pg_control_system()).system_identifier, current_setting('port'), current_database())";

ordered_json Known(const std::optional<std::int64_t>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

std::string AgeText(std::int64_t utime, std::int64_t now) {
  const std::int64_t age = std::max<std::int64_t>(now - utime, 0);
  constexpr std::int64_t kSecondsShown = 120'000'000;  // us
  constexpr std::int64_t kMinutesShown = 7'200'000'000;
  constexpr std::int64_t kHoursShown = 172'800'000'000;
  if (age < kSecondsShown) return Decimal(static_cast<double>(age) / 1e6, 1) + " s";
  if (age < kMinutesShown) return std::to_string(age / 60'000'000) + " min";
  if (age < kHoursShown) return std::to_string(age / 3'600'000'000) + " h";
  return std::to_string(age / 86'400'000'000) + " d";
}

// In units of three digits: FormatSize shows only what a machine's file accepts.
std::string SizeText(std::int64_t bytes) {
  static constexpr const char* kUnits[] = {" B", " kB", " MB", " GB", " TB", " PB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 1'000 && unit + 1 < std::size(kUnits)) {
    value /= 1'000;
    ++unit;
  }
  return Decimal(value, unit == 0 || value >= 100 ? 0 : 1) + kUnits[unit];
}

std::string MachineLine(const MachineStatus& machine, std::int64_t now, const StatusLimits& limits) {
  std::string state = IsLate(machine, now, limits) ? "LATE" : "OK";
  if (machine.new_holes > 0) state += "+HOLES";
  const std::string age = machine.last_utime ? AgeText(*machine.last_utime, now) : "never";
  const std::string last = machine.last_utime ? UtcText(*machine.last_utime) : "-";
  const std::string lag = machine.lag_bytes ? SizeText(*machine.lag_bytes) : "-";
  const std::string logs = machine.lag_logs ? std::to_string(*machine.lag_logs) : "-";
  const std::string rate = machine.samples_per_s ? Decimal(*machine.samples_per_s, 0) : "-";
  const std::string disk = machine.free_bytes && *machine.free_bytes >= 0 ? SizeText(*machine.free_bytes) : "-";
  return Left(machine.name, 24) + ' ' + Left(state, 10) + ' ' + Left(last, 19) + ' ' + Right(age, 8) + ' ' +
         Right(lag, 9) + ' ' + Right(logs, 5) + ' ' + Right(std::to_string(machine.holes), 6) + ' ' +
         Right(std::to_string(machine.odd), 5) + ' ' + Right(rate, 9) + ' ' + Right(disk, 9) + '\n';
}

ordered_json MachineJson(const MachineStatus& machine, std::int64_t now, const StatusLimits& limits) {
  return {{"machine", machine.name},
          {"late", IsLate(machine, now, limits)},
          {"last_utime", Known(machine.last_utime)},
          {"age_us", machine.last_utime ? ordered_json(now - *machine.last_utime) : ordered_json(nullptr)},
          {"last_batch_utime", Known(machine.last_batch)},
          {"lag_bytes", Known(machine.lag_bytes)},
          {"lag_logs", Known(machine.lag_logs)},
          {"holes", machine.holes},
          {"new_holes", machine.new_holes},
          {"odd", machine.odd},
          {"samples_per_s", machine.samples_per_s ? ordered_json(*machine.samples_per_s) : ordered_json(nullptr)},
          {"free_bytes", Known(machine.free_bytes)},
          {"shipper", machine.shipper.empty() ? ordered_json(nullptr) : ordered_json(machine.shipper)}};
}

}  // namespace

bool IsLate(const MachineStatus& machine, std::int64_t now, const StatusLimits& limits) {
  return !machine.last_utime || now - *machine.last_utime > limits.late_us;
}

bool NeedsAttention(const MachineStatus& machine, std::int64_t now, const StatusLimits& limits) {
  return machine.new_holes > 0 || IsLate(machine, now, limits);
}

Result<ServerStatus> ReadServerStatus(FleetReader& reader, const std::string& machine, const StatusLimits& limits) {
  db::Database& database = reader.database();
  ServerStatus status;
  status.host = database.host();
  const auto server = database.Query(kServer);
  if (!server) return Failure(server.error());
  status.now = server->Timestamp(0, 0).value_or(0);
  status.schema_version = server->Int(0, 1).value_or(0);
  status.database_bytes = server->Int(0, 2).value_or(0);
  status.identity = server->Text(0, 3);
  const auto tables = database.Query(kTables);
  if (!tables) return Failure(tables.error());
  for (int row = 0; row < tables->size(); ++row) {
    status.tables.push_back({std::string(tables->Text(row, 0)), tables->Int(row, 1).value_or(0)});
  }
  const auto machines = database.Query(
      kMachines, {machine.empty() ? Parameter::Null() : Parameter::Text(machine), Parameter::Int(limits.holes_us)});
  if (!machines) return Failure(machines.error());
  for (int row = 0; row < machines->size(); ++row) {
    const std::optional<std::int64_t> samples = machines->Int(row, 9);
    status.machines.push_back(
        {.name = std::string(machines->Text(row, 0)),
         .shipper = std::string(machines->Text(row, 1)),
         .last_utime = machines->Int(row, 2),
         .last_batch = machines->Timestamp(row, 3),
         .lag_bytes = machines->Int(row, 4),
         .lag_logs = machines->Int(row, 5),
         .holes = machines->Int(row, 6).value_or(0),
         .new_holes = machines->Int(row, 7).value_or(0),
         .odd = machines->Int(row, 8).value_or(0),
         .samples_per_s = samples ? std::optional(static_cast<double>(*samples) / 60) : std::nullopt,
         .free_bytes = machines->Int(row, 10)});
  }
  return status;
}

std::string FleetStatusText(const std::vector<ServerStatus>& servers, const StatusLimits& limits) {
  std::string text = Left("MACHINE", 24) + ' ' + Left("STATE", 10) + ' ' + Left("LAST DATA (UTC)", 19) + ' ' +
                     Right("AGE", 8) + ' ' + Right("LAG", 9) + ' ' + Right("LOGS", 5) + ' ' + Right("HOLES", 6) +
                     ' ' + Right("ODD", 5) + ' ' + Right("SAMPLES/S", 9) + ' ' + Right("DISK FREE", 9) + '\n';
  for (const ServerStatus& server : servers) {
    for (const MachineStatus& machine : server.machines) text += MachineLine(machine, server.now, limits);
  }
  for (const ServerStatus& server : servers) {
    text += "\nserver " + server.host + ": ";
    if (!server.error.empty()) {
      text += server.error + '\n';
      continue;
    }
    text += "schema version " + std::to_string(server.schema_version) + ", " + SizeText(server.database_bytes);
    for (std::size_t i = 0; i < std::min(server.tables.size(), kTablesShown); ++i) {
      text += (i == 0 ? " (" : ", ") + server.tables[i].name + ' ' + SizeText(server.tables[i].bytes);
    }
    text += server.tables.empty() ? "\n" : ")\n";
  }
  return text;
}

ordered_json FleetStatusJson(const std::vector<ServerStatus>& servers, const StatusLimits& limits) {
  ordered_json list = ordered_json::array();
  for (const ServerStatus& server : servers) {
    ordered_json machines = ordered_json::array();
    for (const MachineStatus& machine : server.machines)
      machines.push_back(MachineJson(machine, server.now, limits));
    ordered_json tables = ordered_json::object();
    for (const TableSize& table : server.tables) tables[table.name] = table.bytes;
    ordered_json one = {{"server", server.host}};
    if (!server.error.empty()) {
      one["error"] = server.error;
    } else {
      one["utime"] = server.now;
      one["schema_version"] = server.schema_version;
      one["database_bytes"] = server.database_bytes;
      one["table_bytes"] = tables;
      one["machines"] = machines;
    }
    list.push_back(one);
  }
  return {{"servers", list}};
}

}  // namespace axlecast
