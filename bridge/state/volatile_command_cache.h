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
  command_status_t latest{};  // the newest status
  command_status_t told{};    // the status that may be published; STATE_UNKNOWN until the acceptance is on disk
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

}  // namespace axlecast
