#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstddef>
#include <deque>
#include <map>

#include "core/base/time.h"
#include "core/device/operation.h"

namespace axlecast {

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
  static constexpr std::size_t kMaxKept = 20'000;  // IsFull returns true from here on

  // Returns null if this bridge has not received the command, or has dropped its status.
  [[nodiscard]] const KnownCommand* Find(const CommandId& id) const;
  [[nodiscard]] bool IsFull(MonoNs now);

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
