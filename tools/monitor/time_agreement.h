#pragma once

#include <cstdint>
#include <map>
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

// Converts instants that hosts state by their own UNIX clocks to UNIX time of one of them, so that a picture shows the readings of several
// hosts beside each other. Used by one thread.
class UnixTimes {
 public:
  // Compares the UNIX clock of this host with that of the root, if both are known now. Call it after each TIME message.
  void Update(const MachineView& machine, const HostView& host, MonoNs now);
  // `utime`: us, UNIX time of the host with the clock `from`. Returns UNIX time (us) of the host with the clock `to`. If a clock was
  // never compared with that of the root, `utime` stays as it is.
  [[nodiscard]] std::int64_t Convert(std::int64_t utime, std::int64_t from, std::int64_t to) const;

 private:
  static constexpr std::size_t kMaxClocks = 64;  // a host that boots has a new clock

  // By clock_id: by how many ns UNIX time is ahead of that of the root. Kept while it lies within the newest difference, so that
  // the instants of a host stay in their order.
  std::map<std::int64_t, std::int64_t> ahead_;
};

// Returns a fault for each host whose UNIX clock is certainly more than 1 s ahead of or behind that of the root, and for each two hosts
// that claim UTC from one reference and whose claims contradict each other.
[[nodiscard]] std::vector<std::string> UtcFaults(const MachineView& machine, MonoNs now);

}  // namespace axlecast
