#pragma once

#include <string>
#include <vector>

#include "drivers/runtime/core/instant.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// What a run of the machine came to.
struct RunSummary {
  std::vector<std::string> faults;  // why it was not a good run; empty when it was
  std::string json;                 // one object: docs/cli.md, `up --json`
  std::string text;                 // for people, several lines

  [[nodiscard]] bool Good() const { return faults.empty(); }
};

// A good run: every device was ONLINE, delivered valid readings and still answers, no reading was lost, every bus
// reported, no process died. `running` is its length, `deaths` as Fleet tells them.
[[nodiscard]] RunSummary Summarize(const MachineView& machine, const std::vector<std::string>& deaths, MonoNs now,
                                   MonoNs running);

}  // namespace axlecast
