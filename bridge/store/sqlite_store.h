#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bridge/store/database.h"
#include "bridge/store/durable_store.h"
#include "core/base/time.h"
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

// The commands of SqliteStore: the tables `commands` and `steps`, and what waits to be written there.
class SqliteJournal {
 public:
  // Commands that are done although they could not be noted (urgent ones), or of which nobody knows whether they
  // were: so many are remembered until they can be written, then the oldest is forgotten.
  static constexpr std::size_t kMaxUnnoted = 10'000;
  // Commands written in one transaction, so that none keeps the bridge waiting.
  static constexpr std::size_t kBatch = 200;

  // In a transaction. False when it cannot be written.
  [[nodiscard]] bool Insert(Database& database, const CommandRecord& record, Timestamp now);
  // After its transaction: what is noted for this id from now on belongs to a command of this bridge.
  void Began(const CommandId& id) { own_.insert(id); }
  // It could not be inserted; what is noted for it all the same is written later.
  void Refused(const CommandRecord& record);

  // Keeps the state of a command until it is written. `epoch` 0: it was not sent again. Returns false if there is no such
  // command. If `database` is null, this is not known, and the state is kept.
  bool Note(Database* database, const command_status_t& status, std::int64_t epoch, Timestamp now);

  // In a transaction: some of what waits, `first` in any case. Written() follows when it was committed.
  [[nodiscard]] bool WriteWaiting(Database& database, const CommandId* first);
  void Written();
  [[nodiscard]] bool waits() const { return !waiting_.empty(); }

  // `database` may be null.
  [[nodiscard]] std::optional<command_status_t> Find(Database* database, const CommandId& id) const;
  // Those without outcome that are not of this bridge.
  [[nodiscard]] std::vector<OpenCommand> Open(Database& database) const;

 private:
  struct Step {
    std::int64_t utime;
    command_status_t status;
  };
  // Of one command, not written yet.
  struct Waiting {
    std::optional<CommandRecord> record;  // when the table has no row of it
    command_status_t status;
    std::int64_t sent_epoch = 0;  // 0: as the table has it
    std::vector<Step> steps;
  };

  [[nodiscard]] std::optional<CommandRecord> TakeRefused(const CommandId& id);
  Waiting& Keep(const CommandId& id, Waiting waiting);
  [[nodiscard]] static bool Write(Database& database, const CommandId& id, const Waiting& waiting);

  std::map<CommandId, Waiting> waiting_;
  std::vector<CommandId> batch_;
  std::set<CommandId> own_;  // accepted by this object, without outcome
  std::map<CommandId, CommandRecord> refused_;
  std::deque<CommandId> refused_order_;
  std::deque<CommandId> unnoted_order_;
};

// The devices of SqliteStore: the tables `axes`, `datums`, `alarm_marks` and `events`, and what waits to be written there.
class SqliteAxes {
 public:
  // Events that could not be written yet; then the oldest is forgotten.
  static constexpr std::size_t kMaxEvents = 1'000;
  // A shaft that stands still is written so seldom: flash wears.
  static constexpr std::int64_t kStandingUs = 60'000'000;

  // `database` may be null.
  [[nodiscard]] AxisRecord Find(Database* database, const std::string& device) const;
  [[nodiscard]] static std::vector<DatumRecord> Datums(Database& database, const std::string& device);
  [[nodiscard]] static std::vector<AlarmMark> Marks(Database& database, const std::string& device);

  // In a transaction.
  [[nodiscard]] static bool Apply(Database& database, const std::string& device, const DeviceChange& change);

  void Keep(const std::string& device, const LastPosition& position) { positions_[device] = position; }
  // After an exchange was committed.
  void Forget(const std::string& device);
  void Note(const AxisEvent& event);

  // Positions that are worth writing; all: even of shafts that stand still.
  enum class Positions : std::uint8_t { kNone, kMoved, kAll };
  // In a transaction: the events, and these positions. Written() follows when it was committed.
  [[nodiscard]] bool WriteWaiting(Database& database, Positions which);
  void Written();
  [[nodiscard]] bool events_wait() const { return !events_.empty(); }
  [[nodiscard]] bool positions_wait() const;

 private:
  [[nodiscard]] bool IsWorthWriting(const std::string& device, const LastPosition& position) const;

  std::map<std::string, LastPosition> positions_;  // not written
  std::map<std::string, LastPosition> written_;    // last
  std::vector<std::string> batch_;                 // of positions_, being written
  std::deque<AxisEvent> events_;
};

// The journal in an SQLite file (docs/journal.md). It keeps every command. If a function returns true, the change is on the
// disk. The file may be missing, full, read-only or damaged at any time. Then state() has the cause, changes return
// false, and reads still work. Tick retries writing every second and opening every 10 s. The store does not use a file
// that another bridge uses, that is older than what was written, or that replaced the opened one (JournalGuard).
class SqliteStore final : public DurableStore {
 public:
  SqliteStore(std::string file, std::string machine);
  ~SqliteStore() override;  // writes what waits
  SqliteStore(const SqliteStore&) = delete;
  SqliteStore& operator=(const SqliteStore&) = delete;

  // False, and no change, for an id that exists.
  [[nodiscard]] bool Accepted(const CommandRecord& record, Timestamp now) override;
  [[nodiscard]] bool Routed(const command_status_t& status, std::int64_t epoch, Timestamp now) override;
  // Like Outcome, passes over a command for which Accepted was never called.
  void Step(const command_status_t& status, Timestamp now) override;
  void Outcome(const command_status_t& status, Timestamp now) override;
  [[nodiscard]] std::optional<command_status_t> Find(const CommandId& id) const override;

  [[nodiscard]] bool Apply(const std::string& device, const DeviceChange& change) override;
  void KeepPosition(const std::string& device, const LastPosition& position) override {
    axes_.Keep(device, position);
  }
  void Note(const AxisEvent& event) override;
  [[nodiscard]] AxisRecord Find(const std::string& device) const override;
  [[nodiscard]] std::vector<DatumRecord> Datums(const std::string& device) const override;
  [[nodiscard]] std::vector<AlarmMark> Marks(const std::string& device) const override;

  // Also after the file could be opened at last: those that it holds.
  [[nodiscard]] std::vector<OpenCommand> Open() const override;
  [[nodiscard]] std::int64_t ReserveEpochs(std::int64_t at_least, std::int64_t count) override;
  void Tick(Timestamp now) override;
  // Another process has this journal: this one cannot ever use it while that runs.
  [[nodiscard]] bool in_use() const { return guard_.held_by_other(); }
  [[nodiscard]] bool readable() const override { return database_ != nullptr; }
  [[nodiscard]] Result<> state() const override { return state_; }

 private:
  using Positions = SqliteAxes::Positions;
  using Writes = std::function<bool(Database& database)>;

  void OpenFile();
  void OpenToRead();
  void LookAfterFile(Timestamp now);
  // `writes` and what waits, in one transaction.
  [[nodiscard]] bool Commit(const Writes& writes, const CommandId* first = nullptr,
                            Positions positions = Positions::kNone);
  void GiveUp(Error error);
  // Opens the file for writing.
  [[nodiscard]] Result<> OpenToWrite();

  const std::string file_;
  const std::string machine_;
  JournalGuard guard_;
  std::unique_ptr<Database> database_;  // null: it could not be opened, or was lost
  bool writable_ = false;
  SqliteJournal journal_;
  SqliteAxes axes_;
  Result<> state_;
  MonoNs look_again_ = 0;
  MonoNs write_again_ = 0;
  MonoNs positions_again_ = 0;
};

}  // namespace axlecast
