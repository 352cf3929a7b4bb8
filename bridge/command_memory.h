#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstddef>
#include <deque>
#include <map>

#include "bridge/brief_memory.h"
#include "bridge/instant.h"

namespace axlecast {

// How every command stands that this bridge has taken up. One that may act is remembered until its validity is over
// and it has ended, whatever becomes of the journal: so no message of this boot acts twice. What only reads is
// remembered briefly.
class CommandMemory {
 public:
  // With less than this many, those that ended are kept longer, to be answered without the journal.
  static constexpr std::size_t kMinKept = 4'096;
  static constexpr std::size_t kMaxKept = 20'000;  // then IsFull

  // Null: this bridge has not taken it up, or has forgotten it since.
  [[nodiscard]] const KnownCommand* Find(const CommandId& id) const;
  [[nodiscard]] bool IsFull(MonoNs now);

  // One that only reads or is only prepared; told at once.
  void PutBrief(const command_status_t& status, MonoNs begin_by) { brief_.Put(status, begin_by); }
  [[nodiscard]] bool IsBrief(const CommandId& id) const { return brief_.Find(id) != nullptr; }
  // One that may act. It is told nothing of yet.
  void Begin(const command_status_t& status, MonoNs begin_by);
  // It stands otherwise now.
  void Update(const command_status_t& status);
  // It may be told so.
  void Tell(const command_status_t& status);
  // It was never taken up.
  void Forget(const CommandId& id) { known_.erase(id); }

 private:
  void Shed(MonoNs now);

  std::map<CommandId, KnownCommand> known_;
  std::deque<CommandId> oldest_first_;
  BriefMemory brief_;
};

}  // namespace axlecast
