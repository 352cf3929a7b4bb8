#include "bridge/memory_journal.h"

#include <algorithm>

#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/command/order_ledger.h"

namespace axlecast {

bool MemoryJournal::Accepted(const command_status_t& status, MonoNs now, MonoNs keep_until) {
  ForgetExpired(now);
  if (entries_.size() >= capacity_) return false;
  expiries_.emplace(keep_until, IdOf(status.id));
  entries_[IdOf(status.id)].details = std::make_unique<command_status_t>(status);
  Set(status);
  if (IsFinalState(status.state)) Outcome(status);
  return true;
}

void MemoryJournal::Step(const command_status_t& status) { Set(status); }

void MemoryJournal::Outcome(const command_status_t& status) {
  Set(status);
  const CommandId id = IdOf(status.id);
  if (std::find(finished_.rbegin(), finished_.rend(), id) == finished_.rend()) finished_.push_back(id);
  while (finished_.size() > detailed_) {
    const auto oldest = entries_.find(finished_.front());
    if (oldest != entries_.end() && IsFinalState(oldest->second.state)) oldest->second.details.reset();
    finished_.pop_front();
  }
}

std::optional<command_status_t> MemoryJournal::Find(const CommandId& id) const {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return std::nullopt;
  const Entry& entry = found->second;
  if (entry.details) return *entry.details;
  command_status_t status{};
  std::copy(id.begin(), id.end(), std::begin(status.id));
  status.body_digest = entry.body_digest;
  status.state = entry.state;
  status.is_final = 1;
  status.verified = entry.verified;
  status.finding = entry.finding;
  status.is_unsigned = entry.is_unsigned;
  status.progress = 1;
  status.reason_code = entry.reason_code;
  status.text = "its details are no longer kept";
  status.finished_utime = entry.finished_utime;
  status.epoch_after = -1;
  return status;
}

void MemoryJournal::Set(const command_status_t& status) {
  const auto found = entries_.find(IdOf(status.id));
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  entry.body_digest = status.body_digest;
  entry.finished_utime = status.finished_utime;
  entry.reason_code = status.reason_code;
  entry.state = status.state;
  entry.verified = status.verified;
  entry.finding = status.finding;
  entry.is_unsigned = status.is_unsigned;
  if (entry.details) *entry.details = status;
}

void MemoryJournal::ForgetExpired(MonoNs now) {
  while (!expiries_.empty() && expiries_.top().first <= now) {
    entries_.erase(expiries_.top().second);
    expiries_.pop();
  }
}

}  // namespace axlecast
