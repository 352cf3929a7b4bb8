#include "bridge/store/sqlite_store.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bridge/store/rows.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxRefused = 256;
constexpr std::size_t kMaxSteps = 100;  // of one command that wait; then the last one is replaced

bool SameChange(const change_t& one, const change_t& other) {
  return one.key == other.key && one.before == other.before && one.after == other.after;
}

// Nothing but the progress became another.
bool SameStep(const command_status_t& one, const command_status_t& other) {
  return one.state == other.state && one.verified == other.verified && one.finding == other.finding &&
         one.reason_code == other.reason_code && one.text == other.text &&
         std::equal(one.changes.begin(), one.changes.end(), other.changes.begin(), other.changes.end(), SameChange);
}

bool InsertStep(Database& database, const std::string& id, const command_status_t& status, std::int64_t utime) {
  return database.Execute(
      "INSERT INTO steps (command, utime, state, verified, finding, reason_code, text, progress, changes) SELECT "
      "number, ?, ?, ?, ?, ?, ?, ?, ? FROM commands WHERE id = ?",
      {utime, std::int64_t{status.state}, std::int64_t{status.verified}, std::int64_t{status.finding},
       std::int64_t{status.reason_code}, status.text, static_cast<double>(status.progress),
       ChangesText(status.changes), id});
}

// Inserts the row of an accepted command. SetStatus updates its state.
bool InsertCommand(Database& database, const std::string& id, const CommandRecord& record) {
  const command_status_t& status = record.status;
  return database.Execute(
      "INSERT INTO commands (id, accepted_utime, begin_by_utime, device, operation, arguments, reason, who, "
      "key_id, is_unsigned, body_digest, bridge_boot_id, driver_boot_id, sent_epoch, state, verified, finding, "
      "reason_code, text, progress, token, started_utime, finished_utime, epoch_after, changes) VALUES (?, ?, ?, "
      "?, ?, ?, ?, ?, ?, ?, ?, ?, 0, 0, ?, 0, 0, 0, '', 0, '', 0, 0, -1, '[]')",
      {id, record.utime, record.begin_by_utime, status.device, status.operation, ArgumentsText(record.arguments),
       record.reason, record.who, record.key_id, std::int64_t{status.is_unsigned}, status.body_digest,
       record.bridge_boot_id, std::int64_t{status.state}});
}

bool SetStatus(Database& database, const std::string& id, const command_status_t& status, std::int64_t sent_epoch) {
  return database.Execute(
      "UPDATE commands SET driver_boot_id = ?, sent_epoch = max(sent_epoch, ?), state = ?, verified = ?, finding = "
      "?, reason_code = ?, text = ?, progress = ?, token = ?, started_utime = ?, finished_utime = ?, epoch_after = "
      "?, changes = ? WHERE id = ?",
      {status.driver_boot_id, sent_epoch, std::int64_t{status.state}, std::int64_t{status.verified},
       std::int64_t{status.finding}, std::int64_t{status.reason_code}, status.text,
       static_cast<double>(status.progress), TokenText(status), status.started_utime, status.finished_utime,
       std::int64_t{status.epoch_after}, ChangesText(status.changes), id});
}

std::optional<CommandRow> Row(Database& database, const CommandId& id) {
  static const std::string kSelect = "SELECT " + std::string(kCommandColumns) + " FROM commands WHERE id = ?";
  Rows rows = database.Select(kSelect, {IdText(id)});
  return rows.Next() ? std::optional(CommandOf(rows)) : std::nullopt;
}

}  // namespace

bool SqliteJournal::Insert(Database& database, const CommandRecord& record, Timestamp now) {
  const std::string id = IdText(IdOf(record.status.id));
  return InsertCommand(database, id, record) && SetStatus(database, id, record.status, 0) &&
         InsertStep(database, id, record.status, now.utime);
}

void SqliteJournal::Refused(const CommandRecord& record) {
  const CommandId id = IdOf(record.status.id);
  if (refused_.insert_or_assign(id, record).second) refused_order_.push_back(id);
  if (refused_order_.size() <= kMaxRefused) return;
  refused_.erase(refused_order_.front());
  refused_order_.pop_front();
}

std::optional<CommandRecord> SqliteJournal::TakeRefused(const CommandId& id) {
  auto taken = refused_.extract(id);
  if (taken.empty()) return std::nullopt;
  refused_order_.erase(std::find(refused_order_.begin(), refused_order_.end(), id));
  return std::move(taken.mapped());
}

SqliteJournal::Waiting& SqliteJournal::Keep(const CommandId& id, Waiting waiting) {
  if (!own_.contains(id)) unnoted_order_.push_back(id);
  if (unnoted_order_.size() > kMaxUnnoted) {
    waiting_.erase(unnoted_order_.front());
    unnoted_order_.pop_front();
  }
  return waiting_.insert_or_assign(id, std::move(waiting)).first->second;
}

bool SqliteJournal::Note(Database* database, const command_status_t& status, std::int64_t epoch, Timestamp now) {
  const CommandId id = IdOf(status.id);
  const auto found = waiting_.find(id);
  Waiting* kept = found == waiting_.end() ? nullptr : &found->second;
  std::optional<command_status_t> before;
  if (kept != nullptr) {
    before = kept->status;
  } else {
    before = Find(database, id);
    std::optional<CommandRecord> record;
    if (!before) record = TakeRefused(id);
    if (!before && !record && database != nullptr && !own_.contains(id)) return false;
    Waiting waiting;
    if (record) waiting.steps.push_back({record->utime, record->status});
    waiting.record = std::move(record);
    kept = &Keep(id, std::move(waiting));
  }
  Waiting& waiting = *kept;
  waiting.status = status;
  waiting.sent_epoch = std::max(waiting.sent_epoch, epoch);
  if (IsFinalState(status.state)) own_.erase(id);
  if (before && SameStep(*before, status)) return true;
  if (waiting.steps.size() >= kMaxSteps) waiting.steps.pop_back();
  waiting.steps.push_back({now.utime, status});
  return true;
}

bool SqliteJournal::Write(Database& database, const CommandId& id, const Waiting& waiting) {
  const std::string text = IdText(id);
  if (waiting.record && !InsertCommand(database, text, *waiting.record)) return false;
  if (!SetStatus(database, text, waiting.status, waiting.sent_epoch)) return false;
  return std::all_of(waiting.steps.begin(), waiting.steps.end(),
                     [&](const Step& step) { return InsertStep(database, text, step.status, step.utime); });
}

bool SqliteJournal::WriteWaiting(Database& database, const CommandId* first) {
  batch_.clear();
  if (first != nullptr && waiting_.contains(*first)) batch_.push_back(*first);
  for (const auto& [id, waiting] : waiting_) {
    if (batch_.size() >= kBatch) break;
    if (first == nullptr || id != *first) batch_.push_back(id);
  }
  return std::all_of(batch_.begin(), batch_.end(),
                     [&](const CommandId& id) { return Write(database, id, waiting_.at(id)); });
}

void SqliteJournal::Written() {
  for (const CommandId& id : batch_) {
    std::erase(unnoted_order_, id);
    waiting_.erase(id);
  }
  batch_.clear();
}

std::optional<command_status_t> SqliteJournal::Find(Database* database, const CommandId& id) const {
  const auto found = waiting_.find(id);
  if (found != waiting_.end()) return found->second.status;
  if (database == nullptr) return std::nullopt;
  std::optional<CommandRow> row = Row(*database, id);
  return row ? std::optional(std::move(row->record.status)) : std::nullopt;
}

std::vector<OpenCommand> SqliteJournal::Open(Database& database) const {
  static const std::string kSelect =
      "SELECT " + std::string(kCommandColumns) +
      " FROM commands WHERE state < 4 OR (state = 9 AND finding = 0) ORDER BY number";
  std::vector<OpenCommand> open;
  for (Rows rows = database.Select(kSelect); rows.Next();) {
    CommandRow row = CommandOf(rows);
    const CommandId id = IdOf(row.record.status.id);
    if (own_.contains(id)) continue;
    if (const auto found = waiting_.find(id); found != waiting_.end()) {
      row.record.status = found->second.status;
      row.sent_epoch = std::max(row.sent_epoch, found->second.sent_epoch);
    }
    if (!IsComplete(row.record.status)) open.push_back({std::move(row.record), row.sent_epoch});
  }
  return open;
}

}  // namespace axlecast
