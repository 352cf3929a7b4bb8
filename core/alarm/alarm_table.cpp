#include "core/alarm/alarm_table.h"

#include <algorithm>
#include <utility>

#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr std::size_t kActionBytes = 80;

}  // namespace

const AlarmShelves::Shelf* AlarmShelves::Find(std::string_view alarm) const {
  const auto found =
      std::find_if(shelves_.begin(), shelves_.end(), [alarm](const Shelf& shelf) { return shelf.alarm == alarm; });
  return found == shelves_.end() ? nullptr : &*found;
}

void AlarmShelves::Put(Shelf shelf) {
  static_cast<void>(Remove(shelf.alarm));
  shelves_.push_back(std::move(shelf));
}

bool AlarmShelves::Remove(std::string_view alarm) {
  return std::erase_if(shelves_, [alarm](const Shelf& shelf) { return shelf.alarm == alarm; }) > 0;
}

bool AlarmShelves::Expire(std::int64_t utime) {
  return std::erase_if(shelves_, [utime](const Shelf& shelf) {
           return shelf.until_utime <= utime || shelf.until_utime - utime > kLongestUs;
         }) > 0;
}

bool AlarmShelves::Hides(const AlarmSpec& alarm) const {
  const Shelf* const shelf = Find(alarm.name);
  return shelf != nullptr && alarm.severity <= shelf->up_to;
}

AlarmTable::Entry* AlarmTable::Find(const AlarmSpec& alarm) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return entry.spec.code == alarm.code && entry.spec.source == alarm.source;
  });
  return found == entries_.end() ? nullptr : &*found;
}

void AlarmTable::Set(const AlarmSpec& alarm, AlarmState state, std::int64_t utime, std::string_view detail) {
  Entry* entry = Find(alarm);
  if (entry == nullptr) {
    if (state == AlarmState::kAbsent) return;
    entry = &entries_.emplace_back(Entry{.spec = alarm});
  }
  if (state != entry->state || entry->unknown) ++revision_;
  if (state != AlarmState::kAbsent && entry->detail != detail) {
    entry->detail = detail;
    ++revision_;
  }
  if (state != AlarmState::kAbsent) {
    if (alarm.severity != entry->spec.severity) Regrade(*entry, alarm);
    if (entry->state == AlarmState::kAbsent) Appear(*entry, utime);
    entry->last_utime = utime;
  } else if (entry->state != AlarmState::kAbsent) {
    Vanish(*entry);
  }
  entry->state = state;
  entry->unknown = false;
}

void AlarmTable::Appear(Entry& entry, std::int64_t utime) {
  entry.first_utime = utime;
  ++entry.count;
  entry.gone = false;
  if (TakeExpected(entry.spec.name, utime)) entry.acknowledged = true;
}

void AlarmTable::Vanish(Entry& entry) {
  entry.gone = entry.spec.severity >= stays_from_ && !entry.acknowledged && !shelves_.Hides(entry.spec);
  SetAcknowledged(entry, false);
}

// A more severe alarm must be acknowledged again.
void AlarmTable::Regrade(Entry& entry, const AlarmSpec& alarm) {
  if (alarm.severity > entry.spec.severity) SetAcknowledged(entry, false);
  entry.spec = alarm;
  ++revision_;
}

void AlarmTable::SetAcknowledged(Entry& entry, bool acknowledged) {
  if (entry.acknowledged == acknowledged) return;
  entry.acknowledged = acknowledged;
  ++acknowledged_revision_;
}

void AlarmTable::SetOffline(bool offline) {
  if (offline == offline_) return;
  offline_ = offline;
  for (Entry& entry : entries_) {
    if (entry.spec.source != alarm_entry_t::SOURCE_DEVICE || entry.state == AlarmState::kAbsent) continue;
    if (entry.unknown != offline) ++revision_;
    entry.unknown = offline;
  }
}

const AlarmSpec* AlarmTable::Worst(std::uint8_t severity) const {
  const Entry* worst = nullptr;
  for (const Entry& entry : entries_) {
    if (entry.state == AlarmState::kAbsent || entry.spec.severity < severity) continue;
    if (worst == nullptr || Worse(&entry, worst)) worst = &entry;
  }
  return worst != nullptr ? &worst->spec : nullptr;
}

bool AlarmTable::Worse(const Entry* a, const Entry* b) {
  if (a->spec.severity != b->spec.severity) return a->spec.severity > b->spec.severity;
  if (a->first_utime != b->first_utime) return a->first_utime > b->first_utime;
  return a->spec.code < b->spec.code;
}

int AlarmTable::Rank(const Entry& entry) const {
  if (shelves_.Hides(entry.spec)) return 2;
  return entry.gone ? 1 : 0;
}

std::int8_t AlarmTable::StateCode(const Entry& entry) const {
  if (shelves_.Hides(entry.spec)) return alarm_entry_t::STATE_SHELVED;
  if (entry.gone) return alarm_entry_t::STATE_UNACKNOWLEDGED;
  if (entry.unknown) return alarm_entry_t::STATE_UNKNOWN;
  if (entry.state == AlarmState::kDeviceLatched) return alarm_entry_t::STATE_DEVICE_LATCHED;
  if (entry.state == AlarmState::kDriverLatched) return alarm_entry_t::STATE_DRIVER_LATCHED;
  return alarm_entry_t::STATE_LIVE;
}

AlarmTable::Standing AlarmTable::Look(std::string_view name) const {
  Standing standing;
  for (const Entry& entry : entries_) {
    if (entry.spec.name != name) continue;
    standing.known = true;
    standing.severity = std::max(standing.severity, entry.spec.severity);
    standing.present = standing.present || entry.state != AlarmState::kAbsent;
    standing.gone = standing.gone || entry.gone;
    standing.acknowledged = standing.acknowledged || entry.acknowledged;
  }
  return standing;
}

void AlarmTable::Acknowledge(std::string_view name) {
  for (Entry& entry : entries_) {
    if (entry.spec.name != name || !IsListed(entry)) continue;
    if (entry.gone) ++revision_;
    entry.gone = false;
    if (entry.state != AlarmState::kAbsent) SetAcknowledged(entry, true);
  }
}

void AlarmTable::AcknowledgeAgain(std::string_view name, std::int64_t until_utime) {
  if (Look(name).present) return Acknowledge(name);
  static_cast<void>(TakeExpected(name, until_utime));
  expected_.push_back({std::string(name), until_utime});
  ++acknowledged_revision_;
}

bool AlarmTable::TakeExpected(std::string_view name, std::int64_t utime) {
  return std::erase_if(expected_, [&](const Expected& expected) {
           return expected.alarm == name && utime <= expected.until_utime;
         }) > 0;
}

std::vector<std::string> AlarmTable::Acknowledged() const {
  std::vector<std::string> names;
  for (const Entry& entry : entries_) {
    if (entry.acknowledged) names.emplace_back(entry.spec.name);
  }
  for (const Expected& expected : expected_) names.push_back(expected.alarm);
  return names;
}

void AlarmTable::Shelve(AlarmShelves::Shelf shelf) {
  for (Entry& entry : entries_) {
    if (entry.spec.name == shelf.alarm && entry.spec.severity <= shelf.up_to) entry.gone = false;
  }
  shelves_.Put(std::move(shelf));
  ++revision_;
}

void AlarmTable::Unshelve(std::string_view name) {
  if (shelves_.Remove(name)) ++revision_;
}

void AlarmTable::Tick(std::int64_t utime) {
  if (shelves_.Expire(utime)) ++revision_;
  const auto late = [utime](const Expected& expected) { return utime > expected.until_utime; };
  if (std::erase_if(expected_, late) > 0) ++acknowledged_revision_;
}

std::string AlarmTable::Names() const {
  std::string names;
  for (const Entry& entry : entries_) {
    if (IsListed(entry)) names += (names.empty() ? "" : ", ") + std::string(entry.spec.name);
  }
  return names;
}

void AlarmTable::Arrange(alarm_t& message) {
  shown_.clear();
  for (const Entry& entry : entries_) {
    if (IsListed(entry)) shown_.push_back(&entry);
  }
  std::sort(shown_.begin(), shown_.end(), [this](const Entry* a, const Entry* b) {
    return Rank(*a) != Rank(*b) ? Rank(*a) < Rank(*b) : Worse(a, b);
  });
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
    out.state = StateCode(entry);
    out.first_utime = entry.first_utime;
    out.count = entry.count;
    out.name = CappedText(entry.spec.name, kNameBytes);
    out.action = CappedText(entry.detail.empty() ? entry.spec.action : entry.detail, kActionBytes);
  }
}

void AlarmTable::Write(alarm_t& message, std::int64_t utime) {
  for (Entry& entry : entries_) {
    if (entry.state == AlarmState::kLive && !entry.unknown) entry.last_utime = utime;
  }
  if (shown_revision_ != revision_) Arrange(message);
  shown_revision_ = revision_;
  message.revision = revision_;
  for (std::size_t i = 0; i < shown_.size(); ++i) message.entries[i].last_utime = shown_[i]->last_utime;
}

ProgramAlarms::ProgramAlarms(std::string name, const Origin& origin) {
  origin.Set(message_);
  message_.seq = -1;
  message_.device = std::move(name);
}

void ProgramAlarms::Set(const AlarmSpec& alarm, bool present, std::int64_t utime, bool latched,
                        std::string_view detail) {
  const AlarmState gone = latched ? AlarmState::kDriverLatched : AlarmState::kAbsent;
  table_.Set(alarm, present ? AlarmState::kLive : gone, utime, detail);
}

const alarm_t& ProgramAlarms::Make(Timestamp now) {
  message_.utime = now.utime;
  message_.mono_ns = now.mono;
  table_.Write(message_, now.utime);
  ++message_.seq;
  return message_;
}

}  // namespace axlecast
