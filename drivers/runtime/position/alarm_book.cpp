#include "drivers/runtime/position/alarm_book.h"

#include <algorithm>

#include "drivers/runtime/command/capped_text.h"

namespace axlecast {
namespace {

constexpr std::size_t kActionBytes = 80;

std::int8_t StateCode(AlarmState state, bool unknown) {
  if (unknown) return alarm_entry_t::STATE_UNKNOWN;
  switch (state) {
    case AlarmState::kDeviceLatched:
      return alarm_entry_t::STATE_DEVICE_LATCHED;
    case AlarmState::kDriverLatched:
      return alarm_entry_t::STATE_DRIVER_LATCHED;
    case AlarmState::kAbsent:
    case AlarmState::kLive:
      break;
  }
  return alarm_entry_t::STATE_LIVE;
}

}  // namespace

AlarmBook::Entry* AlarmBook::Find(const AlarmSpec& alarm) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return entry.spec.code == alarm.code && entry.spec.source == alarm.source;
  });
  return found == entries_.end() ? nullptr : &*found;
}

void AlarmBook::Set(const AlarmSpec& alarm, AlarmState state, std::int64_t utime) {
  Entry* entry = Find(alarm);
  if (entry == nullptr) {
    if (state == AlarmState::kAbsent) return;
    entry = &entries_.emplace_back(Entry{.spec = alarm});
  }
  if (state != entry->state || entry->unknown) ++revision_;
  if (state != AlarmState::kAbsent) {
    if (entry->state == AlarmState::kAbsent) {
      entry->first_utime = utime;
      ++entry->count;
    }
    entry->last_utime = utime;
  }
  entry->state = state;
  entry->unknown = false;
}

void AlarmBook::SetOffline(bool offline) {
  if (offline == offline_) return;
  offline_ = offline;
  for (Entry& entry : entries_) {
    if (entry.spec.source != alarm_entry_t::SOURCE_DEVICE || entry.state == AlarmState::kAbsent) continue;
    if (entry.unknown != offline) ++revision_;
    entry.unknown = offline;
  }
}

const AlarmSpec* AlarmBook::Worst(std::uint8_t severity) const {
  const Entry* worst = nullptr;
  for (const Entry& entry : entries_) {
    if (entry.state == AlarmState::kAbsent || entry.spec.severity < severity) continue;
    if (worst == nullptr || Worse(&entry, worst)) worst = &entry;
  }
  return worst != nullptr ? &worst->spec : nullptr;
}

bool AlarmBook::Worse(const Entry* a, const Entry* b) {
  if (a->spec.severity != b->spec.severity) return a->spec.severity > b->spec.severity;
  if (a->first_utime != b->first_utime) return a->first_utime > b->first_utime;
  return a->spec.code < b->spec.code;
}

void AlarmBook::Arrange(alarm_t& message) {
  shown_.clear();
  for (const Entry& entry : entries_) {
    if (entry.state != AlarmState::kAbsent) shown_.push_back(&entry);
  }
  std::sort(shown_.begin(), shown_.end(), Worse);
  message.total = static_cast<std::int16_t>(shown_.size());
  shown_.resize(std::min<std::size_t>(shown_.size(), alarm_t::MAX_ENTRIES));
  message.n = static_cast<std::int8_t>(shown_.size());
  message.entries.resize(shown_.size());
  for (std::size_t i = 0; i < shown_.size(); ++i) {
    const Entry& entry = *shown_[i];
    alarm_entry_t& out = message.entries[i];
    out.code = entry.spec.code;
    out.source = static_cast<std::int8_t>(entry.spec.source);
    out.severity = static_cast<std::int8_t>(entry.spec.severity);
    out.state = StateCode(entry.state, entry.unknown);
    out.first_utime = entry.first_utime;
    out.count = entry.count;
    out.name = CappedText(entry.spec.name, kNameBytes);
    out.action = CappedText(entry.spec.action, kActionBytes);
  }
}

void AlarmBook::Write(alarm_t& message, std::int64_t utime) {
  for (Entry& entry : entries_) {
    if (entry.state == AlarmState::kLive && !entry.unknown) entry.last_utime = utime;
  }
  if (shown_revision_ != revision_) Arrange(message);
  shown_revision_ = revision_;
  message.revision = revision_;
  for (std::size_t i = 0; i < shown_.size(); ++i) message.entries[i].last_utime = shown_[i]->last_utime;
}

}  // namespace axlecast
