#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstddef>
#include <deque>
#include <map>
#include <optional>

#include "drivers/runtime/core/operation.h"

namespace axlecast {

// How commands stand that need no journal: what only reads, what is only prepared, and urgent ones that the journal
// had no room for. The oldest are forgotten first: one of them that comes again has expired by then, or reads again.
class BriefMemory {
 public:
  explicit BriefMemory(std::size_t capacity = 4'096) : capacity_(capacity) {}

  void Put(const command_status_t& status);
  [[nodiscard]] const command_status_t* Find(const CommandId& id) const;

 private:
  const std::size_t capacity_;
  std::map<CommandId, command_status_t> statuses_;
  std::deque<CommandId> oldest_first_;
};

}  // namespace axlecast
