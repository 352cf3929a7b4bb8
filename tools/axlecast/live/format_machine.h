#pragma once

#include <cstddef>
#include <deque>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// What `axlecast status` and `axlecast info` say (docs/cli.md). Pure.

[[nodiscard]] std::string StatusText(const MachineView& machine, MonoNs now);
[[nodiscard]] nlohmann::ordered_json StatusJson(const MachineView& machine, MonoNs now);

// What this process lost and refused of LCM's datagrams, as `status --json` and `up --json` show it.
[[nodiscard]] nlohmann::ordered_json ReceptionJson(const ReceptionCounts& counts);

// `device` has its DEVICE message.
[[nodiscard]] std::string InfoText(const DeviceView& device, MonoNs now);
[[nodiscard]] nlohmann::ordered_json InfoJson(const DeviceView& device);

// The machine as lines of at most kTableWidth columns of printable ASCII: its devices, its buses, and the newest of
// `events` (warnings of its processes). `running` is the time since its start.
[[nodiscard]] std::vector<std::string> RenderTable(const MachineView& machine, MonoNs now, MonoNs running,
                                                   const std::deque<std::string>& events);

// The same in one line, for output that is no terminal.
[[nodiscard]] std::string RenderLine(const MachineView& machine, MonoNs now, MonoNs running);

// What a run of the machine came to.
struct RunSummary {
  std::vector<std::string> faults;  // why it was not a good run; empty when it was
  std::string json;                 // one object: docs/cli.md, `up --json`
  std::string text;                 // for people, several lines

  [[nodiscard]] bool Good() const { return faults.empty(); }
};

// A good run ends with a good machine (MachineFaults); every device delivered valid readings, none was lost, and no
// process failed. `running` is its length, `deaths` as ProcessSupervisor tells them.
[[nodiscard]] RunSummary Summarize(const MachineView& machine, const std::vector<std::string>& deaths, MonoNs now,
                                   MonoNs running);

}  // namespace axlecast
