#include "bridge/store/sqlite_store.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "bridge/store/database.h"
#include "core/command/commands.h"

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
  state_ = OpenToWrite();
  writable_ = state_.has_value();
  if (!writable_) OpenToRead();
}

Result<> SqliteStore::OpenToWrite() {
  database_.reset();
  if (Result<> taken = guard_.Take(); !taken) return taken;
  auto opened = Database::Open(file_, Database::Access::kReadWrite);
  if (!opened) return Failure(opened.error());
  database_ = std::move(*opened);
  if (Result<> prepared = PrepareSchema(*database_, file_, machine_); !prepared) return prepared;
  if (Result<> same = guard_.Compare(*database_); !same) return same;
  return guard_.Begin(*database_);
}

// What is not the journal that was written last is not read either: its datums are of another time.
void SqliteStore::OpenToRead() {
  database_.reset();
  if (guard_.Replaced()) return;
  auto opened = Database::Open(file_, Database::Access::kReadOnly);
  if (!opened || !CheckSchema(**opened, file_, machine_) || !guard_.Compare(**opened)) return;
  database_ = std::move(*opened);
}

// Deleted or replaced while it was open: it would be written, and nobody would find it.
void SqliteStore::LookAfterFile(Timestamp now) {
  if (writable_ && database_->lost()) GiveUp(database_->result().error());
  if (now.mono < look_again_) return;
  look_again_ = now.mono + kCheckAgain;
  if (writable_ && !guard_.Replaced()) return;
  OpenFile();
}

bool SqliteStore::Commit(const Writes& writes, const CommandId* first, Positions positions) {
  if (!writable_) return false;
  if (guard_.Replaced()) {
    GiveUp(guard_.ReplacedError());
    return false;
  }
  bool counted = false;
  const bool written = database_->Transact([&] {
    counted = guard_.Count(*database_);
    return counted && journal_.WriteWaiting(*database_, first) && axes_.WriteWaiting(*database_, positions) &&
           writes(*database_);
  });
  if (!written) {
    state_ = database_->result();
    if (database_->lost()) {
      GiveUp(state_.error());
    } else if (!counted && state_) {
      GiveUp({file_ + " was changed by another program: stop the other program"});
    }
    return false;
  }
  guard_.Committed();
  journal_.Written();
  axes_.Written();
  state_ = {};
  return true;
}

void SqliteStore::GiveUp(Error error) {
  state_ = Failure(std::move(error));
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

bool SqliteStore::Apply(const std::string& device, const DeviceChange& change) {
  if (writable_ && !Alters(change, Find(device))) return true;
  if (!Commit([&](Database& database) { return SqliteAxes::Apply(database, device, change); })) return false;
  if (DropsPosition(change)) axes_.Forget(device);
  return true;
}

std::vector<DatumRecord> SqliteStore::Datums(const std::string& device) const {
  return database_ ? SqliteAxes::Datums(*database_, device) : std::vector<DatumRecord>();
}

std::vector<AlarmMark> SqliteStore::Marks(const std::string& device) const {
  return database_ ? SqliteAxes::Marks(*database_, device) : std::vector<AlarmMark>();
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
  const bool failed = !state_.has_value();
  if (!positions && !failed && !journal_.waits() && !axes_.events_wait()) return;
  if (positions) positions_again_ = now.mono + kPositionPeriod;
  const bool written =
      Commit(failed ? Writes(Probe) : Writes(Nothing), nullptr, positions ? Positions::kMoved : Positions::kNone);
  write_again_ = now.mono + (written ? kWritePeriod : kWriteAgain);
}

}  // namespace axlecast
