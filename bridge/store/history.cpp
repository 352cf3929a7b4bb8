#include "bridge/store/history.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <string_view>

#include "bridge/store/sqlite_store.h"

namespace axlecast {
namespace {

// SELECT with any number of conditions.
class Query {
 public:
  explicit Query(std::string select) : sql_(std::move(select)) {}

  template <typename... Values>
  void Where(std::string_view condition, Values... values) {
    sql_ += values_.empty() ? " WHERE " : " AND ";
    sql_ += condition;
    (values_.emplace_back(values), ...);
  }
  void WhereEqual(std::string_view column, const std::string& value) {
    if (!value.empty()) Where(std::string(column) + " = ?", std::string_view(value));
  }
  void WhereTime(std::string_view column, const HistoryFilter& filter) {
    if (filter.since_utime) Where(std::string(column) + " >= ?", *filter.since_utime);
    if (filter.until_utime) Where(std::string(column) + " < ?", *filter.until_utime);
  }
  // The newest `limit`, newest first.
  Rows Run(Database& database, std::optional<std::int64_t> limit) {
    sql_ += " ORDER BY number DESC LIMIT ?";
    values_.push_back(limit.value_or(std::numeric_limits<std::int64_t>::max()));
    return database.Select(sql_, values_);
  }

 private:
  std::string sql_;
  std::vector<SqlValue> values_;
};

}  // namespace

HistoryReader::HistoryReader(const std::string& file) {
  if (access(file.c_str(), F_OK) != 0 && errno == ENOENT) {
    state_ = Failure(file +
                     " does not exist: the bridge writes it, at the place that `bridge: journal` names; was the "
                     "bridge started, with the same user and environment?");
    return;
  }
  auto opened = Database::Open(file, Database::Access::kReadOnly);
  state_ = opened ? CheckSchema(**opened, file, "") : Result<>(Failure(opened.error()));
  if (state_) database_ = std::move(*opened);
}

void HistoryReader::Check() {
  if (!database_->result()) state_ = database_->result();
}

std::string HistoryReader::Machine() { return database_ ? MachineOf(*database_) : ""; }

std::vector<CommandRow> HistoryReader::Commands(const HistoryFilter& filter, const std::optional<Mark>& from,
                                                const Mark& to) {
  std::vector<CommandRow> commands;
  if (!database_) return commands;
  Query query("SELECT " + std::string(kCommandColumns) + " FROM commands");
  if (from) {
    query.Where("number IN (SELECT command FROM steps WHERE state >= 4 AND number > ? AND number <= ?)", from->step,
                to.step);
  }
  const std::string beyond = filter.id + 'g';  // behind every hex digit
  if (!filter.id.empty()) query.Where("id >= ? AND id < ?", std::string_view(filter.id), std::string_view(beyond));
  query.WhereEqual("device", filter.device);
  query.WhereEqual("operation", filter.operation);
  query.WhereEqual("who", filter.who);
  if (filter.state) query.Where("state = ?", std::int64_t{*filter.state});
  query.WhereTime("accepted_utime", filter);
  for (Rows rows = query.Run(*database_, filter.limit); rows.Next();) commands.push_back(CommandOf(rows));
  std::reverse(commands.begin(), commands.end());
  Check();
  return commands;
}

std::vector<CommandStep> HistoryReader::Steps(std::int64_t command_number) {
  std::vector<CommandStep> steps;
  if (!database_) return steps;
  for (Rows rows = database_->Select("SELECT utime, state, verified, finding, reason_code, text, progress, changes "
                                     "FROM steps WHERE command = ? ORDER BY number",
                                     {command_number});
       rows.Next();) {
    steps.push_back({.utime = rows.Integer(0),
                     .state = static_cast<std::int8_t>(rows.Integer(1)),
                     .verified = rows.Integer(2) != 0,
                     .finding = static_cast<std::int8_t>(rows.Integer(3)),
                     .reason_code = static_cast<std::int32_t>(rows.Integer(4)),
                     .text = rows.Text(5),
                     .progress = static_cast<float>(rows.Real(6)),
                     .changes = ParseChanges(rows.Text(7))});
  }
  Check();
  return steps;
}

std::vector<AxisEvent> HistoryReader::Events(const HistoryFilter& filter, const std::optional<Mark>& from,
                                             const Mark& to) {
  std::vector<AxisEvent> events;
  if (!database_) return events;
  Query query("SELECT utime, device, kind, text FROM events");
  if (from) query.Where("number > ? AND number <= ?", from->event, to.event);
  query.WhereEqual("device", filter.device);
  query.WhereTime("utime", filter);
  for (Rows rows = query.Run(*database_, filter.limit); rows.Next();) {
    events.push_back({rows.Integer(0), rows.Text(1), rows.Text(2), rows.Text(3)});
  }
  std::reverse(events.begin(), events.end());
  Check();
  return events;
}

std::int64_t HistoryReader::Highest(const char* sql) {
  if (!database_) return 0;
  Rows rows = database_->Select(sql);
  const std::int64_t highest = rows.Next() ? rows.Integer(0) : 0;
  Check();
  return highest;
}

HistoryReader::Mark HistoryReader::Now() {
  return {.step = Highest("SELECT max(number) FROM steps"), .event = Highest("SELECT max(number) FROM events")};
}

std::vector<DeviceRecord> HistoryReader::Devices() {
  static const std::string kSelect =
      "SELECT a.device, " + std::string(kAxisColumns) + " FROM " + std::string(kAxisTables) + " ORDER BY a.device";
  std::vector<DeviceRecord> devices;
  if (!database_) return devices;
  for (Rows rows = database_->Select(kSelect); rows.Next();) devices.push_back({rows.Text(0), AxisOf(rows, 1)});
  Check();
  return devices;
}

std::vector<AlarmMark> HistoryReader::AlarmMarks(const std::string& device) {
  // An older bridge's journal has none.
  if (!database_ || !HasAlarmMarks(*database_)) return {};
  std::vector<AlarmMark> marks = SqliteAxes::Marks(*database_, device);
  Check();
  return marks;
}

std::vector<DatumHistory> HistoryReader::Datums(const std::string& device) {
  static const std::string kSelect = "SELECT number IN (SELECT datum FROM axes WHERE device = ?1), " +
                                     std::string(kDatumColumns) +
                                     " FROM datums WHERE device = ?1 ORDER BY number DESC";
  std::vector<DatumHistory> datums;
  if (!database_) return datums;
  for (Rows rows = database_->Select(kSelect, {device}); rows.Next();) {
    datums.push_back({.datum = DatumOf(rows, 1), .in_force = rows.Integer(0) != 0});
  }
  Check();
  return datums;
}

}  // namespace axlecast
