#include "bridge/store/sqlite_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <utility>

#include "core/command/commands.h"

namespace axlecast {
namespace {

constexpr const char* kGuardFormat = "axlecast-journal-guard 1 %016" PRIx64 " %020" PRIu64 "\n";
constexpr const char* kIdKey = "journal_id";
constexpr const char* kChangesKey = "changes";
constexpr const char* kSetMeta = "INSERT OR REPLACE INTO meta (key, value) VALUES (?, ?)";

// "axlecast-bridge, process 4711": who holds a lock on the file with this inode.
std::string LockHolder(ino_t inode) {
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number;
    std::string kind;
    std::string mode;
    std::string access;
    std::string process;
    std::string file;
    words >> number >> kind >> mode >> access >> process >> file;
    const std::size_t colon = file.rfind(':');
    if (kind != "FLOCK" || colon == std::string::npos || file.substr(colon + 1) != std::to_string(inode)) continue;
    std::string name;
    std::getline(std::ifstream("/proc/" + process + "/comm"), name);
    return (name.empty() ? "a process" : name) + ", process " + process;
  }
  return "another process";
}

std::int64_t MetaInteger(Database& database, const char* key) {
  Rows rows = database.Select("SELECT value FROM meta WHERE key = ?", {std::string_view(key)});
  return rows.Next() ? rows.Integer(0) : 0;
}

std::int64_t RandomStoreId() {
  std::random_device device;
  const std::uint64_t bits = (std::uint64_t{device()} << 32U) | device();
  return static_cast<std::int64_t>(bits >> 1U) | 1;
}

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

JournalGuard::Identity JournalGuard::IdentityOf(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return {};
  return {status.st_dev, status.st_ino};
}

JournalGuard::Guard JournalGuard::ReadGuard() const {
  std::string text;
  std::getline(std::ifstream(guard_path_), text);
  std::uint64_t id = 0;
  std::uint64_t changes = 0;
  if (std::sscanf(text.c_str(), "axlecast-journal-guard 1 %" SCNx64 " %" SCNu64, &id, &changes) != 2) return {};
  return {static_cast<std::int64_t>(id), static_cast<std::int64_t>(changes)};
}

Result<> JournalGuard::Take() {
  if (Replaced()) return Failure(ReplacedError());
  if (file_.valid() && IdentityOf(path_) == identity_) return {};
  file_.Reset();
  struct stat status {};
  const bool absent = stat(path_.c_str(), &status) != 0 ? errno == ENOENT : status.st_size == 0;
  if (absent && ReadGuard().id != 0) {
    return Failure(path_ + " is missing or empty, but " + guard_path_ +
                   " shows that there was a journal: put it, or a backup, back; or remove " + guard_path_ +
                   " to begin an empty one without datums (docs/journal.md)");
  }
  if (Result<> prepared = PrepareFile(path_); !prepared) return prepared;
  Descriptor file(open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY));
  if (!file.valid() || fstat(file.get(), &status) != 0) return Failure(path_ + ": " + std::strerror(errno));
  held_by_other_ = flock(file.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (held_by_other_) {
    return Failure(path_ + " is the journal of another bridge, which runs: " + LockHolder(status.st_ino) +
                   "; stop the other bridge, or give this machine a journal of its own (bridge: journal)");
  }
  file_ = std::move(file);
  identity_ = {status.st_dev, status.st_ino};
  return {};
}

Result<> JournalGuard::Compare(Database& database) const {
  const Guard guard = ReadGuard();
  if (guard.id == 0) return {};
  const std::string accept =
      "; or remove " + guard_path_ +
      " to continue with this one: then check every datum (axlecast datum show, docs/journal.md)";
  if (MetaInteger(database, kIdKey) != guard.id) {
    return Failure(path_ + " is not the journal that was used last: put the right one back" + accept);
  }
  const std::int64_t missing = guard.changes - MetaInteger(database, kChangesKey);
  if (missing <= 0) return {};
  return Failure(path_ + " is older than what the bridge has written (" + std::to_string(missing) +
                 " changes are missing): put the newer one back" + accept);
}

Result<> JournalGuard::Begin(Database& database) {
  changes_ = MetaInteger(database, kChangesKey);
  id_ = MetaInteger(database, kIdKey);
  if (id_ != 0) return {};
  id_ = RandomStoreId();
  const bool written = database.Transact([&] {
    return database.Execute(kSetMeta, {std::string_view(kIdKey), id_});
  });
  return written ? Result<>() : database.result();
}

bool JournalGuard::Count(Database& database) {
  if (MetaInteger(database, kChangesKey) != changes_) return false;
  return database.Execute(kSetMeta, {std::string_view(kChangesKey), changes_ + 1});
}

void JournalGuard::Committed() {
  ++changes_;
  used_ = true;
  if (log_.inode == 0) log_ = IdentityOf(path_ + "-wal");
  WriteGuard();
}

// Not synchronised: after a power failure it may lag behind the journal, and never lies ahead.
void JournalGuard::WriteGuard() {
  if (!note_.valid())
    note_ = Descriptor(open(guard_path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0640));
  std::array<char, 96> text{};
  const int size = std::snprintf(text.data(), text.size(), kGuardFormat, static_cast<std::uint64_t>(id_),
                                 static_cast<std::uint64_t>(changes_));
  if (!note_.valid() || size <= 0) return;
  if (pwrite(note_.get(), text.data(), static_cast<std::size_t>(size), 0) != size) note_.Reset();
}

bool JournalGuard::Replaced() const {
  return used_ && (IdentityOf(path_) != identity_ || (log_.inode != 0 && IdentityOf(path_ + "-wal") != log_));
}

Error JournalGuard::ReplacedError() const {
  return {path_ +
          " (or its -wal) was deleted, moved or replaced while the bridge used it: put it back; or stop the bridge "
          "and restore a backup (docs/journal.md)"};
}

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
