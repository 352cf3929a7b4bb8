#pragma once

#include <axlecast/alarm_entry_t.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/store/durable_store.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// The list of `axlecast alarms` (docs/alarms.md).

using MarksByDevice = std::map<std::string, std::vector<AlarmMark>>;

struct ListedAlarm {
  std::string device;  // or "bridge"
  alarm_entry_t entry{};
  std::optional<AlarmMark> acknowledged = {};
  std::optional<AlarmMark> shelved = {};
};

struct AlarmList {
  std::string machine = {};
  // Present, then gone, then shelved alarms; the worst first, then the newest.
  std::vector<ListedAlarm> alarms = {};
  std::vector<std::pair<std::string, AlarmMark>> idle_shelves =
      {};                                // of alarms that are not listed at present, by device
  std::vector<std::string> silent = {};  // devices whose alarms are unknown
  int not_shown = 0;                     // alarms beyond the capacity of ALARM
  std::string journal_problem = {};      // why acknowledgements are unknown, or empty
};

[[nodiscard]] AlarmList MakeAlarmList(const MachineView& machine, const MarksByDevice& marks, MonoNs now);

[[nodiscard]] std::string ToText(const AlarmList& list);
[[nodiscard]] nlohmann::ordered_json ToJson(const AlarmList& list);

}  // namespace axlecast
