#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// The UNIX clocks of two hosts, compared by the proven time base. This needs the messages of both hosts, so a process that keeps the
// time of one host cannot know it.

// By how much UNIX time of one host is ahead of that of another host at one instant.
struct UtcDifference {
  std::int64_t ns = 0;
  std::int64_t width_ns = 0;  // the difference is within ns +- this
};
// Returns nothing if the two messages have no common base, no claim, or impossible figures.
[[nodiscard]] std::optional<UtcDifference> Difference(const time_quality_t& one, const time_quality_t& other);

// Returns the difference of the host to the root of the time base; nothing if it cannot be known now.
[[nodiscard]] std::optional<UtcDifference> DifferenceToRoot(const MachineView& machine, const HostView& host,
                                                            MonoNs now);

// Returns a fault for each host whose UNIX clock is certainly more than 1 s ahead of or behind that of the root, and for each two hosts
// that claim UTC from one reference and whose claims contradict each other.
[[nodiscard]] std::vector<std::string> UtcFaults(const MachineView& machine, MonoNs now);

}  // namespace axlecast
