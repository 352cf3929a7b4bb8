#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/store/database.h"
#include "bridge/store/durable_store.h"
#include "bridge/store/journal_guard.h"
#include "bridge/store/sqlite_devices.h"
#include "bridge/store/sqlite_journal.h"

namespace axlecast {

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
