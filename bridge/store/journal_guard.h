#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

#include "bridge/store/database.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The file under the journal's name: locked against other bridges, the same one for as long as the bridge runs, and
// never an older one than a bridge has written. For that it counts its changes, and a small file beside it (`-guard`)
// holds the id of the journal and the highest count.
class JournalGuard {
 public:
  explicit JournalGuard(std::string path) : path_(std::move(path)), guard_path_(path_ + "-guard") {}

  // Makes the file if there has never been one, and takes the lock, which ends with the process. Call it before the
  // database is opened.
  [[nodiscard]] Result<> Take();
  // Another process holds the lock.
  [[nodiscard]] bool held_by_other() const { return held_by_other_; }

  // Checks that this open database is the one that bridges have written last.
  [[nodiscard]] Result<> Compare(Database& database) const;
  // Begins to write this database, which Compare has accepted.
  [[nodiscard]] Result<> Begin(Database& database);
  // In a transaction, first of all: counts the change. False when the file was changed by somebody else.
  [[nodiscard]] bool Count(Database& database);
  // The transaction was committed.
  void Committed();
  // The file, or -wal, is no longer the one that was opened: deleted, or another was put in its place.
  [[nodiscard]] bool Replaced() const;
  [[nodiscard]] Error ReplacedError() const;

 private:
  struct Identity {
    dev_t device = 0;
    ino_t inode = 0;
    bool operator==(const Identity&) const = default;
  };
  struct Guard {
    std::int64_t id = 0;  // 0: no id
    std::int64_t changes = 0;
  };

  [[nodiscard]] static Identity IdentityOf(const std::string& path);
  [[nodiscard]] Guard ReadGuard() const;
  void WriteGuard();

  const std::string path_;
  const std::string guard_path_;
  Descriptor file_;  // with the lock. Closed after the database: closing it ends SQLite's own locks.
  Descriptor note_;  // open to be written
  Identity identity_;
  Identity log_;       // of -wal
  bool used_ = false;  // this process has written it: no other file will do
  bool held_by_other_ = false;
  std::int64_t id_ = 0;
  std::int64_t changes_ = 0;
};

}  // namespace axlecast
