#include "bridge/command_memory.h"

#include "drivers/runtime/command/order_ledger.h"

namespace axlecast {

std::optional<command_status_t> CommandMemory::Find(const CommandId& id) const {
  if (const command_status_t* brief = brief_.Find(id)) return *brief;
  return journal_.Find(id);
}

bool CommandMemory::Note(const CommandRecord& record, bool briefly, Instant now) {
  if (!briefly) return journal_.Accepted(record, now);
  brief_.Put(record.status);
  return true;
}

bool CommandMemory::Routed(const command_status_t& status, std::int64_t epoch, Instant now) {
  return IsBrief(status) || journal_.Routed(status, epoch, now);
}

void CommandMemory::Step(const command_status_t& status, Instant now) {
  if (IsBrief(status)) return brief_.Put(status);
  // Routed has noted that already.
  if (status.state != command_status_t::STATE_ROUTED) journal_.Step(status, now);
}

void CommandMemory::Outcome(const command_status_t& status, Instant now) {
  if (IsBrief(status)) return brief_.Put(status);
  journal_.Outcome(status, now);
}

bool CommandMemory::IsBrief(const command_status_t& status) const {
  return brief_.Find(IdOf(status.id)) != nullptr;
}

}  // namespace axlecast
