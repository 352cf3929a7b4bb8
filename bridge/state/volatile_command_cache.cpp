#include "bridge/state/volatile_command_cache.h"

#include "core/command/command_id.h"

namespace axlecast {

void VolatileCommandCache::Put(const command_status_t& status, MonoNs begin_by) {
  const auto [entry, added] = commands_.insert_or_assign(IdOf(status.id), KnownCommand{status, status, begin_by});
  if (!added) return;
  oldest_first_.push_back(entry->first);
  if (oldest_first_.size() <= capacity_) return;
  commands_.erase(oldest_first_.front());
  oldest_first_.pop_front();
}

void VolatileCommandCache::Update(const command_status_t& status) {
  const auto found = commands_.find(IdOf(status.id));
  if (found != commands_.end()) found->second.latest = found->second.told = status;
}

const KnownCommand* VolatileCommandCache::Find(const CommandId& id) const {
  const auto found = commands_.find(id);
  return found == commands_.end() ? nullptr : &found->second;
}

}  // namespace axlecast
