#include "bridge/brief_memory.h"

#include "drivers/runtime/command/order_ledger.h"

namespace axlecast {

void BriefMemory::Put(const command_status_t& status) {
  const auto [entry, added] = statuses_.insert_or_assign(IdOf(status.id), status);
  if (!added) return;
  oldest_first_.push_back(entry->first);
  if (oldest_first_.size() <= capacity_) return;
  statuses_.erase(oldest_first_.front());
  oldest_first_.pop_front();
}

const command_status_t* BriefMemory::Find(const CommandId& id) const {
  const auto found = statuses_.find(id);
  return found == statuses_.end() ? nullptr : &found->second;
}

}  // namespace axlecast
