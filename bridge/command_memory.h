#pragma once

#include <axlecast/command_status_t.hpp>
#include <optional>

#include "bridge/brief_memory.h"
#include "bridge/instant.h"
#include "bridge/journal.h"

namespace axlecast {

// How every command stands that the bridge has taken up: durably in the journal, or briefly.
class CommandMemory {
 public:
  explicit CommandMemory(Journal& journal) : journal_(journal) {}

  [[nodiscard]] std::optional<command_status_t> Find(const CommandId& id) const;
  // False when it had to go into the journal and could not.
  [[nodiscard]] bool Note(const CommandRecord& record, bool briefly, Instant now);
  [[nodiscard]] bool Routed(const command_status_t& status, std::int64_t epoch, Instant now);
  void Step(const command_status_t& status, Instant now);
  void Outcome(const command_status_t& status, Instant now);
  // From now on it is remembered briefly, because the journal cannot.
  void Keep(const command_status_t& status) { brief_.Put(status); }

 private:
  [[nodiscard]] bool IsBrief(const command_status_t& status) const;

  Journal& journal_;
  BriefMemory brief_;
};

}  // namespace axlecast
