#include "tools/fleet/read/fleet_admin.h"

#include <algorithm>
#include <cctype>

#include "core/base/spelling.h"

namespace axlecast {
namespace {

using db::Parameter;

// As a statement that must change one row.
Result<> ChangeOne(FleetReader& reader, const std::string& sql, const db::Parameters& parameters,
                   const std::string& otherwise) {
  const auto changed = reader.database().Execute(sql, parameters);
  if (!changed) return Failure(changed.error());
  if (*changed != 1) return Failure(otherwise);
  return {};
}

}  // namespace

Result<> RenameMachine(FleetReader& reader, const FleetMachine& machine, const std::string& to) {
  const auto other = reader.database().Query("SELECT FROM axlecast.machine WHERE name = $1", {Parameter::Text(to)});
  if (!other) return Failure(other.error());
  if (!other->empty()) {
    return Failure("the database has a machine " + Quoted(to) +
                   " already: histories of two machines cannot be joined; choose another name");
  }
  return ChangeOne(reader, "UPDATE axlecast.machine SET name = $2 WHERE id = $1",
                   {Parameter::Int(machine.id), Parameter::Text(to)},
                   "machine " + machine.name + " was removed meanwhile");
}

Result<> RenameShard(FleetReader& reader, const std::string& from, const std::string& to) {
  const auto changed = reader.database().Execute("UPDATE axlecast.shard SET machine = $2 WHERE machine = $1",
                                                 {Parameter::Text(from), Parameter::Text(to)});
  if (!changed) return Failure(changed.error());
  return {};
}

Result<> AdoptMachine(FleetReader& reader, const FleetMachine& machine, const std::string& installation) {
  return ChangeOne(reader,
                   "UPDATE axlecast.machine SET installation = $2::uuid, generation = generation + 1 WHERE id = $1",
                   {Parameter::Int(machine.id), Parameter::Text(installation)},
                   "machine " + machine.name + " was removed meanwhile");
}

bool IsUuid(const std::string& text) {
  if (text.size() != 36) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool hyphen = i == 8 || i == 13 || i == 18 || i == 23;
    if (hyphen ? text[i] != '-' : std::isxdigit(static_cast<unsigned char>(text[i])) == 0) return false;
  }
  return true;
}

Result<> SetShard(FleetReader& reader, const std::string& machine, const std::string& connection) {
  return ChangeOne(reader,
                   "INSERT INTO axlecast.shard (machine, connection) VALUES ($1, $2)"
                   " ON CONFLICT (machine) DO UPDATE SET connection = excluded.connection",
                   {Parameter::Text(machine), Parameter::Text(connection)}, "the row of the shard was not written");
}

Result<bool> RemoveShard(FleetReader& reader, const std::string& machine) {
  const auto removed =
      reader.database().Execute("DELETE FROM axlecast.shard WHERE machine = $1", {Parameter::Text(machine)});
  if (!removed) return Failure(removed.error());
  return *removed > 0;
}

Result<std::vector<RetentionRule>> ReadRetention(FleetReader& reader) {
  const auto rows = reader.database().Query(
      "SELECT kind, (extract(epoch FROM keep) * 1000000)::int8 FROM axlecast.retention ORDER BY kind");
  if (!rows) return Failure(rows.error());
  std::vector<RetentionRule> rules;
  rules.reserve(static_cast<std::size_t>(rows->size()));
  for (int row = 0; row < rows->size(); ++row)
    rules.push_back({std::string(rows->Text(row, 0)), rows->Int(row, 1)});
  return rules;
}

Result<> SetRetention(FleetReader& reader, const RetentionRule& rule) {
  const auto rules = ReadRetention(reader);
  if (!rules) return Failure(rules.error());
  std::vector<std::string> kinds;
  for (const RetentionRule& known : *rules) kinds.push_back(known.kind);
  if (std::ranges::find(kinds, rule.kind) == kinds.end()) {
    return Failure(Quoted(rule.kind) + " is no kind of rows" + Suggestion(rule.kind, kinds, ": " + Listed(kinds)));
  }
  return ChangeOne(reader,
                   "UPDATE axlecast.retention SET keep = $2::int8 * interval '1 microsecond' WHERE kind = $1",
                   {Parameter::Text(rule.kind), rule.keep_us ? Parameter::Int(*rule.keep_us) : Parameter::Null()},
                   "the rule was removed meanwhile");
}

Result<std::vector<Expired>> Expire(FleetReader& reader) {
  const auto rows = reader.database().Query("SELECT kind, partitions, deleted_rows FROM axlecast.expire()");
  if (!rows) return Failure(rows.error());
  std::vector<Expired> expired;
  expired.reserve(static_cast<std::size_t>(rows->size()));
  for (int row = 0; row < rows->size(); ++row) {
    expired.push_back(
        {std::string(rows->Text(row, 0)), rows->Int(row, 1).value_or(0), rows->Int(row, 2).value_or(0)});
  }
  return expired;
}

}  // namespace axlecast
