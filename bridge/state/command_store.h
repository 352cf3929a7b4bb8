#pragma once

#include <axlecast/argument_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/device/operation.h"

namespace axlecast {

// Something that a driver is to do for the bridge, from its acceptance to its one outcome.
struct PendingCommand {
  enum class Purpose : std::uint8_t {
    kCommand,       // of a client
    kOutcomeCheck,  // what became of a command that ended INDETERMINATE
    kRestore,       // gives a restarted driver back what it has forgotten
  };

  Purpose purpose = Purpose::kCommand;
  CommandId id{};  // on the wire to the driver
  std::string device;
  const OperationSpec* operation = nullptr;  // null: kOutcomeCheck of an operation that nothing can find
  std::vector<argument_t> arguments;
  std::string who;         // name of the key that signed it
  std::string reason;      // the client's
  bool prepare = false;    // only asks what it would do
  bool recovered = false;  // an earlier bridge had routed it
  std::int32_t expect_epoch = -1;
  MonoNs begin_by = kNever;
  bool cancel_asked = false;
  command_status_t status{};  // published only if purpose is kCommand

  // What it waits for in the journal.
  enum class JournalState : std::uint8_t {
    kNone,      // nothing
    kAccepted,  // its acceptance is being written
    kRouted,    // that it is about to be sent is being written
    kReady,     // that is written: it may be sent
  };
  JournalState journal_state = JournalState::kNone;
  MonoNs journal_since = 0;

  // kOutcomeCheck: the command that it is about.
  CommandId about{};
  const OperationSpec* about_operation = nullptr;
  std::vector<argument_t> about_arguments;
  std::int64_t about_boot_id = 0;  // the driver that it had been routed to
  std::int64_t about_epoch = 0;    // of the newest order to do it
  bool about_silent = false;       // that driver fell silent: it may still report the outcome
  bool queries_driver = false;     // by KIND_QUERY; else by its operation
  MonoNs not_before = 0;           // a look that could not read is repeated then

  // Since it was routed.
  std::int32_t reserved_writes = 0;  // of the device's memory, counted before it was sent
  std::int32_t nv_writes = 0;        // that the driver has reported
  bool acknowledged = false;
  std::int64_t sent_epoch = 0;  // of the newest order to do it
  std::int64_t last_seq = -1;   // of the driver's newest status about it
  MonoNs last_status = 0;
  MonoNs routed = 0;
  MonoNs next_send = 0;

  // Of the device's limited memory, by its arguments.
  [[nodiscard]] std::int32_t WritesAtMost() const;
};

// Return a value of the command's arguments, or of its changes; "" for an unknown key.
[[nodiscard]] std::string ArgumentOf(const PendingCommand& pending, std::string_view key);
[[nodiscard]] std::string ChangedTo(const command_status_t& status, std::string_view key);

// An order that the bridge gives by itself, or in the place of a client's operation.
struct BridgeCommand {
  std::string operation;
  std::vector<argument_t> arguments;
};

// The status of a command that the bridge keeps.
struct KnownCommand {
  command_status_t latest{};     // the newest status
  command_status_t published{};  // the status that may be published; STATE_UNKNOWN until the acceptance is on disk
  MonoNs begin_by = 0;
};

// Statuses of commands that are not journalled: read-only commands and PREPARE. If the store is full, the oldest
// status is dropped. If its command arrives again, it has expired by then, or it only reads again.
class VolatileCommandCache {
 public:
  explicit VolatileCommandCache(std::size_t capacity = 4'096) : capacity_(capacity) {}

  void Put(const command_status_t& status, MonoNs begin_by);
  // Replaces the status of a stored command. Does nothing for other commands.
  void Update(const command_status_t& status);
  [[nodiscard]] const KnownCommand* Find(const CommandId& id) const;

 private:
  const std::size_t capacity_;
  std::map<CommandId, KnownCommand> commands_;
  std::deque<CommandId> oldest_first_;
};

// Statuses of all commands that this bridge has received. The status of a command that may act is kept until the
// command has ended and its validity is over, even if the journal is lost: no message of this boot acts twice.
// Statuses of read-only commands are kept in VolatileCommandCache.
class CommandStore {
 public:
  // Up to this many, ended commands are kept longer, so that queries are answered without the journal.
  static constexpr std::size_t kMinKept = 4'096;
  static constexpr std::size_t kMaxKept = 20'000;  // there is no room for another from here on

  // Returns null if this bridge has not received the command, or has dropped its status.
  [[nodiscard]] const KnownCommand* Find(const CommandId& id) const;
  // Drops commands that ended long ago, a few per call. Returns whether there is room for another command.
  [[nodiscard]] bool MakeRoom(MonoNs now);

  // Adds a read-only or PREPARE command. Its status may be published immediately.
  void PutVolatile(const command_status_t& status, MonoNs begin_by) { volatile_.Put(status, begin_by); }
  [[nodiscard]] bool IsVolatile(const CommandId& id) const { return volatile_.Find(id) != nullptr; }
  // Adds a command that may act. Its status may not be published before MarkPublished.
  void Begin(const command_status_t& status, MonoNs begin_by);
  // Replaces the newest status of a stored command.
  void Update(const command_status_t& status);
  // Marks the status as published.
  void MarkPublished(const command_status_t& status);
  // Removes a command whose acceptance was not completed.
  void Forget(const CommandId& id) { known_.erase(id); }

 private:
  void DropEnded(MonoNs now);

  std::map<CommandId, KnownCommand> known_;
  std::deque<CommandId> oldest_first_;
  VolatileCommandCache volatile_;
};

}  // namespace axlecast
