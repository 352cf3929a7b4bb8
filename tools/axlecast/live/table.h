#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

inline constexpr std::size_t kTableWidth = 80;

// The machine as lines of at most kTableWidth columns of printable ASCII: its devices, its buses, and the newest of
// `events` (warnings of its processes). `running` is the time since its start.
[[nodiscard]] std::vector<std::string> RenderTable(const MachineView& machine, MonoNs now, MonoNs running,
                                                   const std::deque<std::string>& events);

// The same in one line, for output that is no terminal.
[[nodiscard]] std::string RenderLine(const MachineView& machine, MonoNs now, MonoNs running);

// "12.5 mm" of the last valid position, with as many decimals as a count is worth; "250.0 W 45.0 degC" of a monitor;
// "-" before the first.
[[nodiscard]] std::string ValueText(const DeviceView& device);

// "battery_alarm" or "battery_alarm +2" when there are more, within `width`; empty without an alarm.
[[nodiscard]] std::string AlarmText(const DeviceView& device, std::size_t width);

}  // namespace axlecast
