#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "bridge/store/database.h"
#include "bridge/store/durable_store.h"
#include "core/base/time.h"

namespace axlecast {

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

}  // namespace axlecast
