#pragma once

#include <string>
#include <vector>

#include "core/base/time.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

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
