#include "bridge/store/sqlite_store.h"

#include <algorithm>

#include "bridge/store/rows.h"
#include "core/command/commands.h"

namespace axlecast {
namespace {

using Kind = AlarmMark::Kind;

std::string_view KindName(Kind kind) { return kind == Kind::kShelved ? "shelved" : "acknowledged"; }

AlarmMark MarkOf(const Rows& row) {
  return {.kind = row.Text(0) == KindName(Kind::kShelved) ? Kind::kShelved : Kind::kAcknowledged,
          .alarm = row.Text(1),
          .utime = row.Integer(2),
          .until_utime = row.Integer(3),
          .up_to = row.Text(4),
          .who = row.Text(5),
          .reason = row.Text(6),
          .command = ParseId(row.Text(7)).value_or(CommandId{}),
          .driver_boot_id = row.Integer(8),
          .known_utime = row.Integer(9)};
}

// Writes a change to the tables. Each function returns false if that fails.
struct Writer {
  Database& database;
  const std::string& device;

  bool operator()(const DatumRecord& datum) const {
    const std::string command = datum.command == CommandId{} ? "" : IdText(datum.command);
    return database.Execute(
               "INSERT INTO datums (device, utime, counts, value, identity, who, command, reason) VALUES (?, ?, ?, "
               "?, ?, ?, ?, ?)",
               {device, datum.utime, datum.counts, datum.value, datum.identity, datum.who, command,
                datum.reason}) &&
           SetAxis("datum", database.inserted_number());
  }
  bool operator()(const DatumVoided& voided) const {
    return database.Execute(
               "UPDATE datums SET voided_utime = ?, voided_why = ? WHERE number = (SELECT datum FROM axes WHERE "
               "device = ?)",
               {voided.utime, voided.why, device}) &&
           database.Execute(
               "UPDATE axes SET datum = NULL, position_counts = NULL, position_utime = NULL WHERE device = ?",
               {device});
  }
  bool operator()(const WritesAdded& added) const {
    return database.Execute(
        "INSERT INTO axes (device, writes, since_utime) VALUES (?, ?, ?) ON CONFLICT (device) DO UPDATE SET writes "
        "= max(writes + excluded.writes, 0), since_utime = iif(since_utime = 0, excluded.since_utime, since_utime)",
        {device, added.writes, added.utime});
  }
  bool operator()(const ReferenceChanged& reference) const {
    return SetAxis("reference_lost", std::int64_t{reference.lost ? 1 : 0});
  }
  bool operator()(const IdentityChanged& changed) const { return SetAxis("identity", changed.identity); }
  bool operator()(const EncoderExchanged& exchanged) const {
    return (*this)(DatumVoided{exchanged.utime, kExchangedReason}) &&
           database.Execute("INSERT OR REPLACE INTO axes (device, identity, since_utime) VALUES (?, ?, ?)",
                            {device, exchanged.identity, exchanged.utime});
  }
  bool operator()(const AlarmMark& mark) const {
    return database.Execute(
        "INSERT OR REPLACE INTO alarm_marks (device, kind, alarm, utime, until_utime, up_to, who, reason, command, "
        "driver_boot_id, known_utime) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        {device, KindName(mark.kind), mark.alarm, mark.utime, mark.until_utime, mark.up_to, mark.who, mark.reason,
         IdText(mark.command), mark.driver_boot_id, mark.known_utime});
  }
  bool operator()(const AlarmMarkEnded& ended) const {
    return database.Execute("DELETE FROM alarm_marks WHERE device = ? AND kind = ? AND alarm = ?",
                            {device, KindName(ended.kind), ended.alarm});
  }

 private:
  [[nodiscard]] bool SetAxis(const std::string& column, const SqlValue& value) const {
    return database.Execute("INSERT INTO axes (device, " + column +
                                ") VALUES (?, ?) ON CONFLICT (device) DO UPDATE SET " + column + " = excluded." +
                                column,
                            {device, value});
  }
};

}  // namespace

AxisRecord SqliteAxes::Find(Database* database, const std::string& device) const {
  static const std::string kSelect =
      "SELECT " + std::string(kAxisColumns) + " FROM " + std::string(kAxisTables) + " WHERE a.device = ?";
  AxisRecord axis;
  if (database != nullptr) {
    Rows rows = database->Select(kSelect, {device});
    if (rows.Next()) axis = AxisOf(rows, 0);
  }
  if (const auto kept = positions_.find(device); kept != positions_.end()) axis.position = kept->second;
  return axis;
}

std::vector<DatumRecord> SqliteAxes::Datums(Database& database, const std::string& device) {
  static const std::string kSelect =
      "SELECT " + std::string(kDatumColumns) + " FROM datums WHERE device = ? ORDER BY number DESC";
  std::vector<DatumRecord> datums;
  for (Rows rows = database.Select(kSelect, {device}); rows.Next();) datums.push_back(DatumOf(rows, 0));
  return datums;
}

std::vector<AlarmMark> SqliteAxes::Marks(Database& database, const std::string& device) {
  std::vector<AlarmMark> marks;
  for (Rows rows =
           database.Select("SELECT kind, alarm, utime, until_utime, up_to, who, reason, command, driver_boot_id, "
                           "known_utime FROM alarm_marks WHERE device = ? ORDER BY kind, alarm",
                           {device});
       rows.Next();) {
    marks.push_back(MarkOf(rows));
  }
  return marks;
}

bool SqliteAxes::Apply(Database& database, const std::string& device, const DeviceChange& change) {
  return std::visit(Writer{database, device}, change);
}

void SqliteAxes::Forget(const std::string& device) {
  positions_.erase(device);
  written_.erase(device);
}

void SqliteAxes::Note(const AxisEvent& event) {
  events_.push_back(event);
  if (events_.size() > kMaxEvents) events_.pop_front();
}

bool SqliteAxes::IsWorthWriting(const std::string& device, const LastPosition& position) const {
  const auto last = written_.find(device);
  return last == written_.end() || last->second.counts != position.counts ||
         position.utime - last->second.utime >= kStandingUs || position.utime < last->second.utime;
}

bool SqliteAxes::positions_wait() const {
  return std::any_of(positions_.begin(), positions_.end(),
                     [this](const auto& entry) { return IsWorthWriting(entry.first, entry.second); });
}

bool SqliteAxes::WriteWaiting(Database& database, Positions which) {
  batch_.clear();
  for (const auto& [device, position] : positions_) {
    if (which == Positions::kNone || (which == Positions::kMoved && !IsWorthWriting(device, position))) continue;
    if (!database.Execute(
            "INSERT INTO axes (device, position_counts, position_utime) VALUES (?, ?, ?) ON CONFLICT (device) DO "
            "UPDATE SET position_counts = excluded.position_counts, position_utime = excluded.position_utime",
            {device, position.counts, position.utime})) {
      return false;
    }
    batch_.push_back(device);
  }
  return std::all_of(events_.begin(), events_.end(), [&database](const AxisEvent& event) {
    return database.Execute("INSERT INTO events (utime, device, kind, text) VALUES (?, ?, ?, ?)",
                            {event.utime, event.device, event.kind, event.text});
  });
}

void SqliteAxes::Written() {
  for (const std::string& device : batch_) {
    written_[device] = positions_.at(device);
    positions_.erase(device);
  }
  batch_.clear();
  events_.clear();
}

}  // namespace axlecast
