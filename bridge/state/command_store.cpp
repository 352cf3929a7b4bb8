#include "bridge/state/command_store.h"

#include <algorithm>
#include <utility>

#include "core/command/commands.h"

namespace axlecast {
namespace {

using S = command_status_t;

}  // namespace

std::int32_t PendingCommand::WritesAtMost() const {
  if (operation == nullptr || operation->writes == nullptr) return 0;
  Arguments pairs;
  for (const argument_t& argument : arguments) pairs.emplace_back(argument.key, argument.value);
  return operation->writes(pairs);
}

std::string ArgumentOf(const PendingCommand& pending, std::string_view key) {
  const auto found = std::find_if(pending.arguments.begin(), pending.arguments.end(),
                                  [&](const argument_t& argument) { return argument.key == key; });
  return found == pending.arguments.end() ? "" : found->value;
}

std::string ChangedTo(const command_status_t& status, std::string_view key) {
  const auto found = std::find_if(status.changes.begin(), status.changes.end(),
                                  [&](const change_t& change) { return change.key == key; });
  return found == status.changes.end() ? "" : found->after;
}

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
  if (found != commands_.end()) found->second.latest = found->second.published = status;
}

const KnownCommand* VolatileCommandCache::Find(const CommandId& id) const {
  const auto found = commands_.find(id);
  return found == commands_.end() ? nullptr : &found->second;
}

const KnownCommand* CommandStore::Find(const CommandId& id) const {
  const auto found = known_.find(id);
  return found == known_.end() ? volatile_.Find(id) : &found->second;
}

bool CommandStore::MakeRoom(MonoNs now) {
  DropEnded(now);
  return known_.size() < kMaxKept;
}

void CommandStore::Begin(const S& status, MonoNs begin_by) {
  const CommandId id = IdOf(status.id);
  KnownCommand known{status, status, begin_by};
  known.published.state = S::STATE_UNKNOWN;
  if (known_.insert_or_assign(id, std::move(known)).second) oldest_first_.push_back(id);
}

void CommandStore::Update(const S& status) {
  const CommandId id = IdOf(status.id);
  if (const auto found = known_.find(id); found != known_.end()) {
    found->second.latest = status;
  } else {
    volatile_.Update(status);
  }
}

void CommandStore::MarkPublished(const S& status) {
  if (const auto found = known_.find(IdOf(status.id)); found != known_.end()) found->second.published = status;
}

// Forgets the oldest, a few at a time. Those that are open still, or valid, go to the end of the queue.
void CommandStore::DropEnded(MonoNs now) {
  constexpr int kAtOnce = 16;
  for (int looked = 0; looked < kAtOnce && oldest_first_.size() > kMinKept; ++looked) {
    const CommandId id = oldest_first_.front();
    oldest_first_.pop_front();
    const auto found = known_.find(id);
    if (found == known_.end()) continue;
    if (IsComplete(found->second.latest) && found->second.begin_by < now) {
      known_.erase(found);
    } else {
      oldest_first_.push_back(id);
    }
  }
}

}  // namespace axlecast
