#include "tools/mqtt/outbox.h"

#include <unistd.h>

#include <utility>

namespace axlecast {
namespace {

// Bytes that the containers take for a message.
constexpr std::size_t kOverhead = 200;

std::size_t SizeOf(const BrokerMessage& message) {
  return message.topic.size() + message.payload.size() + kOverhead;
}

}  // namespace

Outbox::Outbox(Limits limits) : limits_(limits) {}

void Outbox::Put(BrokerMessage message, RetentionClass keeping) {
  const std::scoped_lock lock(mutex_);
  ++counts_.put;
  if (keeping == RetentionClass::kNewest) {
    if (const auto older = newest_.find(message.topic); older != newest_.end()) {
      ++counts_.replaced;
      Erase(entries_.find(older->second));
    }
  }
  const std::size_t bytes = SizeOf(message);
  MakeRoom(bytes);
  if (entries_.size() >= limits_.messages || static_cast<std::size_t>(counts_.bytes) + bytes > limits_.bytes) {
    ++counts_.shed[static_cast<std::size_t>(keeping)];  // all others are unconfirmed
    return;
  }
  const std::int64_t id = next_id_++;
  if (keeping == RetentionClass::kNewest) newest_[message.topic] = id;
  entries_.emplace(id, Entry{std::move(message), keeping});
  waiting_[static_cast<std::size_t>(keeping)].insert(id);
  ++counts_.messages;
  counts_.bytes += static_cast<std::int64_t>(bytes);
  Signal();
}

void Outbox::MakeRoom(std::size_t bytes) {
  while (entries_.size() >= limits_.messages || static_cast<std::size_t>(counts_.bytes) + bytes > limits_.bytes) {
    if (!Shed(RetentionClass::kSamples) && !Shed(RetentionClass::kEvents) && !Shed(RetentionClass::kNewest)) return;
  }
}

// Returns false if no message of this class is queued.
bool Outbox::Shed(RetentionClass keeping) {
  const std::set<std::int64_t>& waiting = waiting_[static_cast<std::size_t>(keeping)];
  if (waiting.empty()) return false;
  ++counts_.shed[static_cast<std::size_t>(keeping)];
  Erase(entries_.find(*waiting.begin()));
  return true;
}

void Outbox::Erase(Entries::iterator entry) {
  const auto& [id, value] = *entry;
  waiting_[static_cast<std::size_t>(value.keeping)].erase(id);
  if (const auto newest = newest_.find(value.message.topic); newest != newest_.end() && newest->second == id) {
    newest_.erase(newest);
  }
  --counts_.messages;
  counts_.bytes -= static_cast<std::int64_t>(SizeOf(value.message));
  entries_.erase(entry);
}

std::optional<Outbox::Next> Outbox::Take() {
  const std::scoped_lock lock(mutex_);
  std::int64_t first = next_id_;
  std::set<std::int64_t>* of = nullptr;
  for (std::set<std::int64_t>& waiting : waiting_) {
    if (waiting.empty() || *waiting.begin() >= first) continue;
    first = *waiting.begin();
    of = &waiting;
  }
  if (of == nullptr) {
    event_.Take();
    signalled_ = false;
    return std::nullopt;
  }
  of->erase(of->begin());
  const Entry& entry = entries_.at(first);
  if (entry.keeping == RetentionClass::kNewest) newest_.erase(entry.message.topic);
  return Next{first, entry.message};
}

void Outbox::Confirm(std::int64_t id) {
  const std::scoped_lock lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return;
  ++counts_.taken;
  Erase(entry);
}

void Outbox::Refuse(std::int64_t id) {
  const std::scoped_lock lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return;
  ++counts_.refused;
  Erase(entry);
}

void Outbox::Return() {
  const std::scoped_lock lock(mutex_);
  // Begins with the newest message, so that the newest state of a topic remains.
  for (auto entry = entries_.end(); entry != entries_.begin();) {
    --entry;
    const auto& [id, value] = *entry;
    if (value.keeping == RetentionClass::kNewest && !newest_.emplace(value.message.topic, id).second &&
        newest_[value.message.topic] != id) {
      ++counts_.replaced;
      const auto older = entry++;
      Erase(older);
      continue;
    }
    waiting_[static_cast<std::size_t>(value.keeping)].insert(id);
  }
  if (!entries_.empty()) Signal();
}

OutboxCounts Outbox::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

void Outbox::Signal() {
  if (signalled_) return;
  signalled_ = true;
  event_.Set();
}

}  // namespace axlecast
