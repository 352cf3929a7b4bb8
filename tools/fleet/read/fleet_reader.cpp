#include "tools/fleet/read/fleet_reader.h"

#include <optional>
#include <utility>

#include "core/base/spelling.h"
#include "tools/fleet/schema/migration.h"

namespace axlecast {
namespace {

using db::Parameter;

std::vector<std::string> FirstColumn(const db::Rows& rows) {
  std::vector<std::string> texts;
  texts.reserve(static_cast<std::size_t>(rows.size()));
  for (int row = 0; row < rows.size(); ++row) texts.emplace_back(rows.Text(row, 0));
  return texts;
}

}  // namespace

FleetReader::FleetReader(db::DatabaseSettings settings, SecretSource& secrets)
    : settings_(std::move(settings)), secrets_(secrets) {}

Result<> FleetReader::Open() { return Connect(settings_); }

Result<> FleetReader::OpenOther(const std::string& connection) {
  db::DatabaseSettings settings = settings_;
  settings.connection = connection;
  return Connect(settings);
}

Result<> FleetReader::Connect(const db::DatabaseSettings& settings) {
  database_ = std::make_unique<db::Database>(settings, secrets_);
  const auto connected = database_->Connect();
  no_answer_ = !connected && (connected.error().fault == db::DatabaseFault::kConnectionLost ||
                              connected.error().fault == db::DatabaseFault::kTimeLimit);
  if (!connected) return Failure(connected.error());
  if (const auto checked = CheckSchema(*database_); !checked) return Failure(checked.error());
  return {};
}

Result<FleetMachine> FleetReader::OpenMachine(const std::string& name) {
  if (Result<> opened = Open(); !opened) return Failure(opened.error());
  const auto shard =
      database_->Query("SELECT connection FROM axlecast.shard WHERE machine = $1", {Parameter::Text(name)});
  if (!shard) return Failure(shard.error());
  if (!shard->empty()) {
    if (Result<> opened = OpenOther(std::string(shard->Text(0, 0))); !opened) {
      return Failure("the shard of " + Quoted(name) + ": " + opened.error().text);
    }
  }
  const auto machine = database_->Query("SELECT id FROM axlecast.machine WHERE name = $1", {Parameter::Text(name)});
  if (!machine) return Failure(machine.error());
  if (!machine->empty()) return FleetMachine{machine->Int(0, 0).value_or(0), name};
  const auto names = database_->Query(
      "SELECT name FROM axlecast.machine UNION SELECT machine FROM axlecast.shard ORDER BY 1 LIMIT 10000");
  if (!names) return Failure(names.error());
  return Failure("the database has no machine " + Quoted(name) +
                 Suggestion(name, FirstColumn(*names), ": `axlecast fleet status` lists the machines"));
}

Result<std::vector<std::string>> FleetReader::Shards() {
  const auto rows = database_->Query("SELECT DISTINCT connection FROM axlecast.shard ORDER BY 1");
  if (!rows) return Failure(rows.error());
  return FirstColumn(*rows);
}

Result<std::vector<FleetDevice>> FleetReader::Devices(const FleetMachine& machine, const std::string& name) {
  const auto rows = database_->Query("SELECT name, id FROM axlecast.device WHERE machine = $1 ORDER BY name",
                                     {Parameter::Int(machine.id)});
  if (!rows) return Failure(rows.error());
  std::vector<FleetDevice> devices;
  for (int row = 0; row < rows->size(); ++row) {
    if (name.empty() || rows->Text(row, 0) == name) {
      devices.push_back({rows->Int(row, 1).value_or(0), std::string(rows->Text(row, 0))});
    }
  }
  if (!devices.empty() || name.empty()) return devices;
  const std::vector<std::string> names = FirstColumn(*rows);
  return Failure("machine " + machine.name + " has no device " + Quoted(name) + " in the database" +
                 Suggestion(name, names, names.empty() ? "" : ": it has " + Listed(names)));
}

Result<std::vector<FleetStream>> FleetReader::Streams(const FleetDevice& device, std::string_view table,
                                                      std::string_view time, std::int64_t from,
                                                      std::int64_t until) {
  const std::string place = "rows." + std::string(time);
  const auto rows = database_->Query(
      "SELECT id, boot_id, datum_epoch, counts_per_turn, unit, unit_per_count FROM axlecast.stream WHERE device = "
      "$1"
      " AND EXISTS (SELECT FROM " +
          std::string(table) + " AS rows WHERE rows.stream = stream.id AND " + place + " >= $2 AND " + place +
          " < $3) ORDER BY seen, id",
      {Parameter::Int(device.id), Parameter::Timestamp(from), Parameter::Timestamp(until)});
  if (!rows) return Failure(rows.error());
  std::vector<FleetStream> streams;
  for (int row = 0; row < rows->size(); ++row) {
    const auto number = [&](int column) { return rows->Int(row, column).value_or(0); };
    streams.push_back({.id = number(0),
                       .key = {.device = device.name,
                               .boot_id = number(1),
                               .datum_epoch = static_cast<std::int32_t>(number(2)),
                               .counts_per_turn = number(3),
                               .unit = static_cast<std::int8_t>(number(4)),
                               .unit_per_count = rows->Float(row, 5)}});
  }
  return streams;
}

Result<std::vector<FleetLog>> FleetReader::Logs(const FleetMachine& machine) {
  const auto rows = database_->Query(
      "SELECT id, name, host, start_utime, file_number, file, upto, bytes, chain, closed, first_utime, last_utime, "
      "samples, events"
      " FROM axlecast.log WHERE machine = $1 ORDER BY start_utime, file_number, id",
      {Parameter::Int(machine.id)});
  if (!rows) return Failure(rows.error());
  std::vector<FleetLog> logs;
  for (int row = 0; row < rows->size(); ++row) {
    const auto number = [&](int column) { return rows->Int(row, column).value_or(0); };
    logs.push_back({.id = number(0),
                    .name = std::string(rows->Text(row, 1)),
                    .host = std::string(rows->Text(row, 2)),
                    .start_utime = number(3),
                    .file_number = number(4),
                    .file = std::string(rows->Text(row, 5)),
                    .upto = number(6),
                    .bytes = number(7),
                    .chain = number(8),
                    .closed = rows->Bool(row, 9).value_or(false),
                    .first_utime = number(10),
                    .last_utime = number(11),
                    .samples = number(12),
                    .events = number(13)});
  }
  return logs;
}

Result<> FleetReader::ForEach(const std::string& sql, const db::Parameters& parameters,
                              const std::function<bool(const db::Rows&)>& visit) {
  bool ended = false;
  const auto done = database_->ForEach(sql, parameters, [&](const db::Rows& row) {
    ended = !visit(row);
    return !ended;
  });
  if (!done && !ended) return Failure(done.error());
  return {};
}

}  // namespace axlecast
