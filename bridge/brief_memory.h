#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstddef>
#include <deque>
#include <map>

#include "bridge/instant.h"
#include "drivers/runtime/core/operation.h"

namespace axlecast {

// A command as the bridge remembers it.
struct KnownCommand {
  command_status_t latest{};  // how it stands
  command_status_t told{};    // what may be told of it; STATE_UNKNOWN until its acceptance is durable
  MonoNs begin_by = 0;
};

// How commands stand that need no journal: what only reads, and what is only prepared. The oldest are forgotten
// first: one of them that comes again has expired by then, or reads again.
class BriefMemory {
 public:
  explicit BriefMemory(std::size_t capacity = 4'096) : capacity_(capacity) {}

  void Put(const command_status_t& status, MonoNs begin_by);
  // How one that is known stands now.
  void Update(const command_status_t& status);
  [[nodiscard]] const KnownCommand* Find(const CommandId& id) const;

 private:
  const std::size_t capacity_;
  std::map<CommandId, KnownCommand> commands_;
  std::deque<CommandId> oldest_first_;
};

}  // namespace axlecast
