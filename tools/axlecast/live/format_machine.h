#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// What `axlecast status`, `info` and `up` print (docs/cli.md).

// The rows of `axlecast status`.
enum class StatusRows : std::uint8_t {
  kByNumber,  // of a machine with more than kMaxGoodRows devices: numbers, and only the rows that need attention
  kAll,       // numbers, and every row
};
inline constexpr std::size_t kMaxGoodRows = 16;

[[nodiscard]] std::string StatusText(const MachineView& machine, MonoNs now,
                                     StatusRows rows = StatusRows::kByNumber);
[[nodiscard]] nlohmann::ordered_json StatusJson(const MachineView& machine, MonoNs now);

// The DEVICE message of `device` must have been received.
[[nodiscard]] std::string InfoText(const DeviceView& device, MonoNs now);
[[nodiscard]] nlohmann::ordered_json InfoJson(const DeviceView& device);

// Formats the machine as lines of printable ASCII, at most kTableWidth columns wide: devices, buses and `events` (warnings of
// its processes). `running`: time since its start.
[[nodiscard]] std::vector<std::string> RenderTable(const MachineView& machine, MonoNs now, MonoNs running,
                                                   const std::deque<std::string>& events);

// Formats the machine in one line, for output that is not a terminal.
[[nodiscard]] std::string RenderLine(const MachineView& machine, MonoNs now, MonoNs running);

// The result of a run of the machine.
struct RunSummary {
  std::vector<std::string> faults;  // empty if the run was good
  std::string json;                 // one object: docs/cli.md, `up --json`
  std::string text;                 // several lines

  [[nodiscard]] bool Good() const { return faults.empty(); }
};

// Summarizes a run of length `running`. It is good if the machine is good at its end (MachineFaults), every device delivered
// valid readings, no reading was lost and no process failed. `deaths`: the failures that ProcessSupervisor reported.
[[nodiscard]] RunSummary Summarize(const MachineView& machine, const std::vector<std::string>& deaths, MonoNs now,
                                   MonoNs running);

}  // namespace axlecast
