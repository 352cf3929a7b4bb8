#pragma once

#include <axlecast/alarm_t.hpp>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tools/fleet/rows.h"

namespace axlecast {

// Follows the ALARM messages of one channel, each of which contains all alarms that are present, and finds what changed.
//
// An alarm appears with a new first_utime, changes with its state, its severity or its texts, and clears when it is no longer in
// the message. If not all alarms fit into the messages, one that is not listed counts as present. The alarms of an
// earlier boot_id are cleared with the cause "restarted". The first message that an object sees shows all its alarms as
// appeared: their rows are equal if they were composed before.
class AlarmChanges {
 public:
  // `device`: for the rows.
  explicit AlarmChanges(std::string device) : device_(std::move(device)) {}

  // Adds the rows of a message. Returns false for a message that came before or is late: it changes nothing.
  // `times`: of rows. An alarm whose first_utime is outside appears at the time of the message, which must be within.
  bool On(const alarm_t& message, const UtimeRange& times, std::vector<AlarmRow>& rows);

 private:
  using Key = std::tuple<std::int8_t, std::int32_t, std::string>;  // source, code, name
  struct Boot {
    std::int64_t id = 0;
    std::int64_t seq = 0;  // of its newest message
  };
  static constexpr std::size_t kBoots = 4;  // of which a late message is known as such

  [[nodiscard]] bool IsNew(const alarm_t& message);
  [[nodiscard]] AlarmRow Row(const alarm_t& message, const alarm_entry_t& entry, AlarmChange change) const;
  void Clear(const alarm_t& message, const alarm_entry_t& entry, const char* cause,
             std::vector<AlarmRow>& rows) const;

  std::string device_;
  std::deque<Boot> boots_;    // newest last
  std::int64_t boot_id_ = 0;  // of `present_`
  std::map<Key, alarm_entry_t> present_;
};

}  // namespace axlecast
