#include "bridge/store/sqlite_alarms.h"

#include "core/command/command_id.h"
#include "core/messages/enum_names.h"

namespace axlecast::sqlite_alarms {
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

}  // namespace

bool Set(Database& database, const std::string& device, const AlarmMark& mark) {
  const std::string command = IdText(mark.command);
  return database.Execute(
      "INSERT OR REPLACE INTO alarm_marks (device, kind, alarm, utime, until_utime, up_to, who, reason, command, "
      "driver_boot_id, known_utime) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      {device, KindName(mark.kind), mark.alarm, mark.utime, mark.until_utime, mark.up_to, mark.who, mark.reason,
       command, mark.driver_boot_id, mark.known_utime});
}

bool End(Database& database, const std::string& device, Kind kind, const std::string& alarm) {
  return database.Execute("DELETE FROM alarm_marks WHERE device = ? AND kind = ? AND alarm = ?",
                          {device, KindName(kind), alarm});
}

std::vector<AlarmMark> Of(Database& database, const std::string& device) {
  std::vector<AlarmMark> marks;
  for (Rows rows = database.Select(
           "SELECT kind, alarm, utime, until_utime, up_to, who, reason, command, driver_boot_id, known_utime "
           "FROM alarm_marks WHERE device = ? ORDER BY kind, alarm",
           {device});
       rows.Next();) {
    marks.push_back(MarkOf(rows));
  }
  return marks;
}

}  // namespace axlecast::sqlite_alarms
