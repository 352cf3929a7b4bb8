#include "bridge/store/sqlite_store.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "bridge/store/database.h"
#include "bridge/store/sqlite_devices.h"
#include "core/command/command_id.h"

namespace axlecast {
namespace {

constexpr MonoNs kCheckAgain = 10 * kSecond;
constexpr MonoNs kPositionPeriod = kSecond;
constexpr MonoNs kWritePeriod = 100 * kMillisecond;
constexpr MonoNs kWriteAgain = kSecond;  // after a failure

bool Nothing(Database& /*database*/) { return true; }

// Changes a page, so that a full disk is detected.
bool Probe(Database& database) {
  return database.Execute("INSERT OR REPLACE INTO meta (key, value) VALUES ('probe', 0)");
}

}  // namespace

SqliteStore::SqliteStore(std::string file, std::string machine)
    : file_(std::move(file)), machine_(std::move(machine)), guard_(file_) {
  OpenFile();
}

SqliteStore::~SqliteStore() {
  do {
    if (!Commit(Nothing, nullptr, Positions::kAll)) return;
  } while (journal_.waits());
}

void SqliteStore::OpenFile() {
  database_.reset();
  problem_ = guard_.Take();
  if (problem_.empty()) database_ = Database::Open(file_, Database::Access::kReadWrite, problem_);
  if (database_) problem_ = PrepareSchema(*database_, file_, machine_);
  if (database_ && problem_.empty()) problem_ = guard_.Compare(*database_);
  if (database_ && problem_.empty()) problem_ = guard_.PushRecovered(*database_);
  writable_ = database_ && problem_.empty();
  if (!writable_) OpenToRead();
}

// What is not the journal that was written last is not read either: its datums are of another time.
void SqliteStore::OpenToRead() {
  database_.reset();
  if (guard_.Replaced()) return;
  std::string problem;  // problem_ has the cause already
  database_ = Database::Open(file_, Database::Access::kReadOnly, problem);
  if (!database_) return;
  if (!CheckSchema(*database_, file_, machine_).empty() || !guard_.Compare(*database_).empty()) {
    database_.reset();
  }
}

// Deleted or replaced while it was open: it would be written, and nobody would find it.
void SqliteStore::LookAfterFile(Timestamp now) {
  if (writable_ && database_->lost()) Fail();
  if (now.mono < look_again_) return;
  look_again_ = now.mono + kCheckAgain;
  if (writable_ && !guard_.Replaced()) return;
  OpenFile();
}

bool SqliteStore::Commit(const Writes& writes, const CommandId* first, Positions positions) {
  if (!writable_) return false;
  if (guard_.Replaced()) {
    GiveUp(guard_.ReplacedProblem());
    return false;
  }
  bool counted = false;
  const bool written = database_->Transact([&] {
    counted = guard_.Count(*database_);
    return counted && journal_.WriteWaiting(*database_, first) && axes_.WriteWaiting(*database_, positions) &&
           writes(*database_);
  });
  if (!written) {
    Fail();
    if (!counted && problem_.empty()) GiveUp(file_ + " was changed by another program: stop that one");
    return false;
  }
  guard_.Committed();
  journal_.Written();
  axes_.Written();
  problem_.clear();
  return true;
}

void SqliteStore::Fail() {
  problem_ = database_->problem();
  if (database_->lost()) GiveUp(problem_);
}

void SqliteStore::GiveUp(std::string problem) {
  problem_ = std::move(problem);
  writable_ = false;
  database_.reset();
}

bool SqliteStore::Accepted(const CommandRecord& record, Timestamp now) {
  const CommandId id = IdOf(record.status.id);
  if (Find(id)) return false;
  if (!Commit([&](Database& database) { return journal_.Insert(database, record, now); })) {
    journal_.Refused(record);
    return false;
  }
  if (record.status.is_final == 0) journal_.Began(id);
  return true;
}

bool SqliteStore::Routed(const command_status_t& status, std::int64_t epoch, Timestamp now) {
  const CommandId id = IdOf(status.id);
  return journal_.Note(database_.get(), status, epoch, now) && Commit(Nothing, &id);
}

void SqliteStore::Step(const command_status_t& status, Timestamp now) {
  static_cast<void>(journal_.Note(database_.get(), status, 0, now));
}

void SqliteStore::Outcome(const command_status_t& status, Timestamp now) {
  const CommandId id = IdOf(status.id);
  if (!journal_.Note(database_.get(), status, 0, now)) return;
  static_cast<void>(Commit(Nothing, &id));  // Tick tries again
}

std::optional<command_status_t> SqliteStore::Find(const CommandId& id) const {
  return journal_.Find(database_.get(), id);
}

AxisRecord SqliteStore::Find(const std::string& device) const { return axes_.Find(database_.get(), device); }

bool SqliteStore::SetDatum(const std::string& device, const DatumRecord& datum) {
  return Commit([&](Database& database) { return SqliteAxes::SetDatum(database, device, datum); });
}

bool SqliteStore::VoidDatum(const std::string& device, std::int64_t utime, const std::string& why) {
  if (!Commit([&](Database& database) { return SqliteAxes::VoidDatum(database, device, utime, why); }))
    return false;
  axes_.Forget(device);
  return true;
}

std::vector<DatumRecord> SqliteStore::Datums(const std::string& device) const {
  return database_ ? SqliteAxes::Datums(*database_, device) : std::vector<DatumRecord>();
}

bool SqliteStore::AddWrites(const std::string& device, std::int64_t writes, std::int64_t utime) {
  return Commit([&](Database& database) { return SqliteAxes::AddWrites(database, device, writes, utime); });
}

bool SqliteStore::SetReferenceLost(const std::string& device, bool lost) {
  if (writable_ && Find(device).reference_lost == lost) return true;
  return Commit([&](Database& database) { return SqliteAxes::SetReferenceLost(database, device, lost); });
}

bool SqliteStore::SetIdentity(const std::string& device, const std::string& identity) {
  if (writable_ && Find(device).identity == identity) return true;
  return Commit([&](Database& database) { return SqliteAxes::SetIdentity(database, device, identity); });
}

bool SqliteStore::Exchange(const std::string& device, const std::string& identity, std::int64_t utime) {
  if (!Commit([&](Database& database) { return SqliteAxes::Exchange(database, device, identity, utime); })) {
    return false;
  }
  axes_.Forget(device);
  return true;
}

bool SqliteStore::SetMark(const std::string& device, const AlarmMark& mark) {
  return Commit([&](Database& database) { return SetAlarmMark(database, device, mark); });
}

bool SqliteStore::EndMark(const std::string& device, AlarmMark::Kind kind, const std::string& alarm) {
  return Commit([&](Database& database) { return EndAlarmMark(database, device, kind, alarm); });
}

std::vector<AlarmMark> SqliteStore::Marks(const std::string& device) const {
  return database_ ? AlarmMarksOf(*database_, device) : std::vector<AlarmMark>();
}

void SqliteStore::KeepPosition(const std::string& device, const LastPosition& position) {
  axes_.Keep(device, position);
}

void SqliteStore::Note(const AxisEvent& event) {
  axes_.Note(event);
  static_cast<void>(Commit(Nothing));  // Tick tries again
}

std::vector<OpenCommand> SqliteStore::Open() const {
  return database_ ? journal_.Open(*database_) : std::vector<OpenCommand>();
}

std::int64_t SqliteStore::ReserveEpochs(std::int64_t at_least, std::int64_t count) {
  std::int64_t first = 0;
  const bool reserved =
      count > 0 && Commit([&](Database& database) {
        std::int64_t last = 0;
        {
          Rows rows = database.Select("SELECT value FROM meta WHERE key = 'last_epoch'");
          if (rows.Next()) last = rows.Integer(0);
        }
        if (last > std::numeric_limits<std::int64_t>::max() - count) return false;
        first = std::max({last + 1, at_least, std::int64_t{1}});
        if (first > std::numeric_limits<std::int64_t>::max() - count) return false;
        return database.Execute("INSERT OR REPLACE INTO meta (key, value) VALUES ('last_epoch', ?)",
                                {first + count - 1});
      });
  return reserved ? first : 0;
}

void SqliteStore::Tick(Timestamp now) {
  LookAfterFile(now);
  if (!writable_ || now.mono < write_again_) return;
  const bool positions = now.mono >= positions_again_ && axes_.positions_wait();
  const bool failed = !problem_.empty();
  if (!positions && !failed && !journal_.waits() && !axes_.events_wait()) return;
  if (positions) positions_again_ = now.mono + kPositionPeriod;
  const bool written =
      Commit(failed ? Writes(Probe) : Writes(Nothing), nullptr, positions ? Positions::kMoved : Positions::kNone);
  write_again_ = now.mono + (written ? kWritePeriod : kWriteAgain);
}

}  // namespace axlecast
