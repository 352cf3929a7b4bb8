#include "bridge/store/schema.h"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

constexpr std::string_view kMeta =
    "CREATE TABLE meta (key TEXT PRIMARY KEY NOT NULL, value NOT NULL) WITHOUT ROWID";

constexpr std::array<std::string_view, 10> kTables = {
    // The numbers of state, finding and reason_code as words.
    R"(CREATE TABLE words (
  kind TEXT NOT NULL, number INTEGER NOT NULL, word TEXT NOT NULL, PRIMARY KEY (kind, number)) WITHOUT ROWID)",
    R"(CREATE TABLE commands (
  number INTEGER PRIMARY KEY,
  id TEXT NOT NULL UNIQUE,
  accepted_utime INTEGER NOT NULL,
  begin_by_utime INTEGER NOT NULL,
  device TEXT NOT NULL,
  operation TEXT NOT NULL,
  arguments TEXT NOT NULL,
  reason TEXT NOT NULL,
  who TEXT NOT NULL,
  key_id INTEGER NOT NULL,
  is_unsigned INTEGER NOT NULL,
  body_digest INTEGER NOT NULL,
  bridge_boot_id INTEGER NOT NULL,
  driver_boot_id INTEGER NOT NULL,
  sent_epoch INTEGER NOT NULL,
  state INTEGER NOT NULL,
  verified INTEGER NOT NULL,
  finding INTEGER NOT NULL,
  reason_code INTEGER NOT NULL,
  text TEXT NOT NULL,
  progress REAL NOT NULL,
  token TEXT NOT NULL,
  started_utime INTEGER NOT NULL,
  finished_utime INTEGER NOT NULL,
  epoch_after INTEGER NOT NULL,
  changes TEXT NOT NULL))",
    "CREATE INDEX commands_of_device ON commands (device, number)",
    "CREATE INDEX commands_open ON commands (number) WHERE state < 4 OR (state = 9 AND finding = 0)",
    R"(CREATE TABLE steps (
  number INTEGER PRIMARY KEY,
  command INTEGER NOT NULL REFERENCES commands (number),
  utime INTEGER NOT NULL,
  state INTEGER NOT NULL,
  verified INTEGER NOT NULL,
  finding INTEGER NOT NULL,
  reason_code INTEGER NOT NULL,
  text TEXT NOT NULL,
  progress REAL NOT NULL,
  changes TEXT NOT NULL))",
    "CREATE INDEX steps_of_command ON steps (command, number)",
    R"(CREATE TABLE datums (
  number INTEGER PRIMARY KEY,
  device TEXT NOT NULL,
  utime INTEGER NOT NULL,
  counts INTEGER NOT NULL,
  value TEXT NOT NULL,
  identity TEXT NOT NULL,
  who TEXT NOT NULL,
  command TEXT NOT NULL,
  reason TEXT NOT NULL,
  voided_utime INTEGER,
  voided_why TEXT))",
    "CREATE INDEX datums_of_device ON datums (device, number)",
    R"(CREATE TABLE axes (
  device TEXT PRIMARY KEY NOT NULL,
  identity TEXT NOT NULL DEFAULT '',
  reference_lost INTEGER NOT NULL DEFAULT 0,
  writes INTEGER NOT NULL DEFAULT 0,
  since_utime INTEGER NOT NULL DEFAULT 0,
  position_counts INTEGER,
  position_utime INTEGER,
  datum INTEGER REFERENCES datums (number)) WITHOUT ROWID)",
    R"(CREATE TABLE events (
  number INTEGER PRIMARY KEY,
  utime INTEGER NOT NULL,
  device TEXT NOT NULL,
  kind TEXT NOT NULL,
  text TEXT NOT NULL))",
};

// Came later than the others: made where it is missing. Who does not know it passes over it, so the version stays.
constexpr std::string_view kAlarmMarks = R"(CREATE TABLE IF NOT EXISTS alarm_marks (
  device TEXT NOT NULL,
  kind TEXT NOT NULL,
  alarm TEXT NOT NULL,
  utime INTEGER NOT NULL,
  until_utime INTEGER NOT NULL,
  up_to TEXT NOT NULL,
  who TEXT NOT NULL,
  reason TEXT NOT NULL,
  command TEXT NOT NULL,
  driver_boot_id INTEGER NOT NULL,
  known_utime INTEGER NOT NULL,
  PRIMARY KEY (device, kind, alarm)) WITHOUT ROWID)";

// For people: what stands in `commands` in words.
constexpr std::string_view kView = R"(CREATE VIEW history AS
  SELECT c.number, strftime('%Y-%m-%d %H:%M:%S', c.accepted_utime / 1000000, 'unixepoch') AS time, c.id, c.who,
         c.device, c.operation, c.arguments, s.word AS outcome, r.word AS cause, f.word AS found, c.verified, c.text,
         c.changes, c.reason
  FROM commands c
  LEFT JOIN words s ON s.kind = 'state' AND s.number = c.state
  LEFT JOIN words r ON r.kind = 'reason' AND r.number = c.reason_code
  LEFT JOIN words f ON f.kind = 'finding' AND f.number = c.finding)";

constexpr std::string_view kVersionKey = "schema_version";
constexpr std::string_view kMachineKey = "machine";

// Of every number that this program knows; a newer program adds its own.
bool WriteWords(Database& database) {
  const auto write = [&database](std::string_view kind, auto name) {
    for (int number = 0; number == 0 || name(number) != "unknown"; ++number) {
      if (!database.Execute("INSERT OR REPLACE INTO words (kind, number, word) VALUES (?, ?, ?)",
                            {kind, std::int64_t{number}, name(number)})) {
        return false;
      }
    }
    return true;
  };
  return write("state", [](int number) { return StateName(static_cast<std::int8_t>(number)); }) &&
         write("finding", [](int number) { return FindingName(static_cast<std::int8_t>(number)); }) &&
         write("reason", [](int number) { return ReasonName(number); });
}

bool Make(Database& database, const std::string& machine) {
  return database.Transact([&] {
    if (!database.Execute(kMeta)) return false;
    for (const std::string_view table : kTables) {
      if (!database.Execute(table)) return false;
    }
    constexpr std::string_view kInsert = "INSERT INTO meta (key, value) VALUES (?, ?)";
    return database.Execute(kAlarmMarks) && database.Execute(kView) && WriteWords(database) &&
           database.Execute(kInsert, {kVersionKey, kSchemaVersion}) &&
           database.Execute(kInsert, {kMachineKey, machine});
  });
}

// How many tables there are; nothing when that cannot be read.
std::optional<std::int64_t> CountTables(Database& database, std::string_view name) {
  Rows rows = database.Select("SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name LIKE ?", {name});
  return rows.Next() ? std::optional(rows.Integer(0)) : std::nullopt;
}

std::string MetaText(Database& database, std::string_view key) {
  Rows rows = database.Select("SELECT value FROM meta WHERE key = ?", {key});
  return rows.Next() ? rows.Text(0) : "";
}

std::string CheckVersion(Database& database, const std::string& path) {
  const std::string text = MetaText(database, kVersionKey);
  if (text == std::to_string(kSchemaVersion)) return "";
  if (!database.problem().empty()) return database.problem();
  if (text.empty()) return path + " is no journal of axlecast: name another file (bridge: journal)";
  return path + " was written by a newer axlecast (its version is " + text + ", this program knows " +
         std::to_string(kSchemaVersion) + "): install that one, or name another file (bridge: journal)";
}

}  // namespace

std::string PrepareSchema(Database& database, const std::string& path, const std::string& machine) {
  const std::optional<std::int64_t> tables = CountTables(database, "%");
  if (!tables) return database.problem();
  if (*tables == 0) return Make(database, machine) ? "" : database.problem();
  if (std::string problem = CheckSchema(database, path, machine); !problem.empty()) return problem;
  const bool completed =
      database.Transact([&database] { return database.Execute(kAlarmMarks) && WriteWords(database); });
  return completed ? "" : database.problem();
}

std::string CheckSchema(Database& database, const std::string& path, const std::string& machine) {
  const std::optional<std::int64_t> tables = CountTables(database, "meta");
  if (!tables) return database.problem();
  if (*tables == 0) return path + " is no journal of axlecast: name another file (bridge: journal)";
  if (std::string problem = CheckVersion(database, path); !problem.empty()) return problem;
  if (const std::string owner = MachineOf(database); !machine.empty() && owner != machine) {
    return path + " is the journal of machine '" + owner + "', not of '" + machine +
           "': name another file (bridge: journal)";
  }
  return "";
}

bool HasAlarmMarks(Database& database) { return CountTables(database, "alarm_marks").value_or(0) > 0; }

std::string MachineOf(Database& database) { return MetaText(database, kMachineKey); }

}  // namespace axlecast
