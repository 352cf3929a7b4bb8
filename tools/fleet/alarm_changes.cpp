#include "tools/fleet/alarm_changes.h"

#include <algorithm>
#include <set>

#include "core/messages/json/message_json.h"
#include "tools/fleet/event_rows.h"

namespace axlecast {
namespace {

bool Differs(const alarm_entry_t& a, const alarm_entry_t& b) {
  return a.state != b.state || a.severity != b.severity || a.action != b.action;
}

}  // namespace

const char* AlarmChangeName(AlarmChange change) {
  switch (change) {
    case AlarmChange::kAppeared:
      return "appeared";
    case AlarmChange::kChanged:
      return "changed";
    case AlarmChange::kCleared:
      break;
  }
  return "cleared";
}

bool AlarmChanges::IsNew(const alarm_t& message) {
  const auto known =
      std::find_if(boots_.begin(), boots_.end(), [&](const Boot& boot) { return boot.id == message.boot_id; });
  if (known == boots_.end()) {
    boots_.push_back({.id = message.boot_id, .seq = message.seq});
    if (boots_.size() > kBoots) boots_.pop_front();
    return true;
  }
  if (message.seq <= known->seq) return false;
  known->seq = message.seq;
  return true;
}

AlarmRow AlarmChanges::Row(const alarm_t& message, const alarm_entry_t& entry, AlarmChange change) const {
  return {.t = message.utime,
          .device = device_,
          .boot_id = boot_id_,
          .code = entry.code,
          .name = CleanText(entry.name),
          .source = entry.source,
          .severity = entry.severity,
          .state = entry.state,
          .change = change,
          .text = CleanText(entry.action),
          .first_utime = entry.first_utime,
          .last_utime = entry.last_utime,
          .count = entry.count,
          .cause = {},
          .message = JsonbText(ToJson(entry))};
}

void AlarmChanges::Clear(const alarm_t& message, const alarm_entry_t& entry, const char* cause,
                         std::vector<AlarmRow>& rows) const {
  rows.push_back(Row(message, entry, AlarmChange::kCleared));
  rows.back().cause = cause;
}

bool AlarmChanges::On(const alarm_t& message, const UtimeRange& times, std::vector<AlarmRow>& rows) {
  if (!IsNew(message)) return false;
  if (message.boot_id != boot_id_) {
    for (const auto& [key, entry] : present_) Clear(message, entry, "restarted", rows);
    present_.clear();
    boot_id_ = message.boot_id;
  }

  std::set<Key> listed;
  for (const alarm_entry_t& entry : message.entries) {
    const Key key{entry.source, entry.code, entry.name};
    if (!listed.insert(key).second) continue;
    const auto [place, is_new] = present_.try_emplace(key, entry);
    if (!is_new && place->second.first_utime == entry.first_utime) {
      if (Differs(place->second, entry)) rows.push_back(Row(message, entry, AlarmChange::kChanged));
      place->second = entry;
      continue;
    }
    if (!is_new) Clear(message, place->second, "", rows);
    place->second = entry;
    rows.push_back(Row(message, entry, AlarmChange::kAppeared));
    if (times.Contains(entry.first_utime)) rows.back().t = entry.first_utime;
  }

  std::size_t hidden = static_cast<std::size_t>(std::max<std::int16_t>(message.total, 0));
  hidden -= std::min(hidden, listed.size());
  for (auto alarm = present_.begin(); alarm != present_.end();) {
    if (listed.contains(alarm->first)) {
      ++alarm;
    } else if (hidden > 0) {
      --hidden;
      ++alarm;
    } else {
      Clear(message, alarm->second, "", rows);
      alarm = present_.erase(alarm);
    }
  }
  return true;
}

}  // namespace axlecast
