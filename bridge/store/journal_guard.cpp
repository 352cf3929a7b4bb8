#include "bridge/store/journal_guard.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <random>
#include <sstream>

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

std::int64_t RandomId() {
  std::random_device device;
  const std::uint64_t bits = (std::uint64_t{device()} << 32U) | device();
  return static_cast<std::int64_t>(bits >> 1U) | 1;
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
  id_ = RandomId();
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

}  // namespace axlecast
