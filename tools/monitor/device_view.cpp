#include "tools/monitor/device_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace axlecast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

const alarm_entry_t* Find(const std::vector<alarm_entry_t>& entries, const alarm_entry_t& wanted) {
  const auto found = std::find_if(entries.begin(), entries.end(), [&wanted](const alarm_entry_t& entry) {
    return entry.code == wanted.code && entry.source == wanted.source;
  });
  return found == entries.end() ? nullptr : &*found;
}

bool SameState(const alarm_entry_t& one, const alarm_entry_t& other) {
  return one.state == other.state && one.severity == other.severity && one.count == other.count &&
         one.name == other.name;
}

}  // namespace

bool AlarmView::On(alarm_t message, MonoNs now) {
  const auto total = static_cast<std::size_t>(std::max<std::int16_t>(message.total, 0));
  bool changed = !heard_ || total != total_;
  for (const alarm_entry_t& entry : message.entries) {
    const alarm_entry_t* before = Find(entries_, entry);
    if (before == nullptr) Keep(message.utime, true, entry);
    changed = changed || before == nullptr || !SameState(*before, entry);
    if (seen_.size() < kMaxSeen) seen_.insert(entry.name);
  }
  // Of a cut list, what is missing may only have given way to what is worse.
  const bool complete = total <= message.entries.size();
  for (const alarm_entry_t& before : entries_) {
    if (Find(message.entries, before) != nullptr) continue;
    changed = true;
    if (complete) Keep(message.utime, false, before);
  }
  entries_ = std::move(message.entries);
  total_ = std::max(total, entries_.size());
  at_ = now;
  heard_ = true;
  return changed;
}

void AlarmView::Keep(std::int64_t utime, bool appeared, const alarm_entry_t& entry) {
  changes_.push_back({utime, appeared, entry});
  if (changes_.size() > kMaxChanges) changes_.pop_front();
}

std::optional<std::int8_t> DeviceView::State(MonoNs now) const {
  if (info && now - info_at <= kStaleAfter) return info->state;
  if (valid_at && now - *valid_at <= kStaleAfter) {
    const bool degraded = info && info->state == device_info_t::STATE_DEGRADED;
    return degraded ? device_info_t::STATE_DEGRADED : device_info_t::STATE_ONLINE;
  }
  if (info && readings.received() > 0 && now - reading_at <= kStaleAfter) return info->state;
  return std::nullopt;
}

double DeviceView::Turns() const {
  if (!valid || valid->counts_per_turn <= 0) return kUnknown;
  return static_cast<double>(valid->counts) / static_cast<double>(valid->counts_per_turn);
}

double DeviceView::SpeedRpm() const {
  if (!position || (position->flags & position_t::FLAG_SPEED_VALID) == 0) return kUnknown;
  return position->speed_rad_s * 60 / (2 * std::numbers::pi);
}

bool DeviceView::Heard() const {
  if (!info || has_position || motor) return info.has_value();
  return info->state != device_info_t::STATE_ONLINE && info->state != device_info_t::STATE_DEGRADED;
}

const bus_health_t* BusView::FreshHealth(MonoNs now) const {
  return health && now - health_at <= kStaleAfter ? &*health : nullptr;
}

std::optional<std::int8_t> BusView::State(MonoNs now) const {
  if (const bus_health_t* fresh = FreshHealth(now)) return fresh->state;
  if (valid_at && now - *valid_at <= kStaleAfter) return bus_health_t::STATE_UP;
  return std::nullopt;
}

}  // namespace axlecast
