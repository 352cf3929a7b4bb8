#include "tools/monitor/time_agreement.h"

#include <algorithm>
#include <cstdlib>

#include "core/base/text.h"
#include "core/time/offset_bound.h"

namespace axlecast {
namespace {

using Q = time_quality_t;

constexpr std::int64_t kLatest = std::int64_t{1}
                                 << 61;  // ns of UNIX time in 2043: differences of four instants have room
constexpr std::int64_t kMaxWidth = kLatest / 16;
constexpr std::int64_t kMaxDistance = 10 * kSecond;  // of the instants of two messages
constexpr std::int64_t kMaxDifference = kSecond;
// The rate of the base, a quartz, against UTC, in addition to the rates that the messages state.
constexpr std::int64_t kBaseRatePpb = 100'000;

std::string Milliseconds(std::int64_t ns) { return Text("%.3f ms", static_cast<double>(ns) * 1e-6); }
std::string Seconds(std::int64_t ns) { return Text("%.6f s", static_cast<double>(ns) * 1e-9); }

// What UNIX time is ahead of the base. A message of an earlier version has it in us only.
std::int64_t AheadOfBase(const time_quality_t& quality) {
  return (quality.utc_ns != 0 ? quality.utc_ns : quality.utime * kMicrosecond) - quality.base_ns;
}

bool IsPossible(const time_quality_t& quality) {
  const auto is_within = [](std::int64_t value, std::int64_t limit) { return value >= 0 && value <= limit; };
  return is_within(quality.utc_ns, kLatest) && is_within(quality.utime, kLatest / kMicrosecond) &&
         is_within(quality.base_ns, kLatest) && is_within(quality.half_width_ns, kMaxWidth) &&
         quality.utc_half_width_ns <= kMaxWidth && quality.growth_ppb >= 0;
}

std::string ClockFault(const std::string& host, const std::string& root, const UtcDifference& difference) {
  return "UNIX time: the clock of " + host + " is " + Seconds(std::abs(difference.ns)) + " +-" +
         Seconds(difference.width_ns) + (difference.ns > 0 ? " ahead of" : " behind") + " that of " + root +
         ": permits of earlier versions are refused, and logs of the two hosts have times that do not fit; set "
         "both clocks by "
         "one server (`chronyc tracking` and `chronyc makestep` on each)";
}

std::string ClaimFault(const HostView& one, const HostView& other, const UtcDifference& difference) {
  return "UNIX time: " + one.name + " and " + other.name + " claim UTC from " + one.quality.utc_reference +
         " within " + Milliseconds(one.quality.utc_half_width_ns) + " and " +
         Milliseconds(other.quality.utc_half_width_ns) + ", but their clocks differ by " +
         Milliseconds(std::abs(difference.ns)) + " +-" + Milliseconds(difference.width_ns) +
         ": one claim is wrong; compare `chronyc sources` and `chronyc tracking` on both hosts";
}

bool HaveOneReference(const HostView& one, const HostView& other) {
  return one.quality.utc_half_width_ns >= 0 && other.quality.utc_half_width_ns >= 0 &&
         one.quality.utc_source == Q::SOURCE_CHRONY && other.quality.utc_source == Q::SOURCE_CHRONY &&
         !one.quality.utc_reference.empty() && one.quality.utc_reference == other.quality.utc_reference;
}

}  // namespace

std::optional<UtcDifference> Difference(const time_quality_t& one, const time_quality_t& other) {
  if (one.base_id == 0 || one.base_id != other.base_id) return std::nullopt;
  if (!IsPossible(one) || !IsPossible(other)) return std::nullopt;
  if (std::abs(one.base_ns - other.base_ns) > kMaxDistance) return std::nullopt;
  const std::int64_t growth = std::int64_t{std::max(one.growth_ppb, other.growth_ppb)} + kBaseRatePpb;
  const std::int64_t width =
      one.half_width_ns + other.half_width_ns + Widening(one.base_ns - other.base_ns, growth);
  return UtcDifference{AheadOfBase(one) - AheadOfBase(other), width};
}

std::optional<UtcDifference> DifferenceToRoot(const MachineView& machine, const HostView& host, MonoNs now) {
  for (const HostView& root : machine.hosts()) {
    if (root.name != machine.time_root() || !root.Claims(now) || !host.Claims(now)) continue;
    return Difference(host.quality, root.quality);
  }
  return std::nullopt;
}

void UnixTimes::Update(const MachineView& machine, const HostView& host, MonoNs now) {
  const auto difference = DifferenceToRoot(machine, host, now);
  if (!difference || host.quality.clock_id == 0) return;
  if (ahead_.size() >= kMaxClocks) ahead_.clear();
  std::int64_t& ahead = ahead_.try_emplace(host.quality.clock_id, difference->ns).first->second;
  if (std::abs(difference->ns - ahead) > difference->width_ns) ahead = difference->ns;
}

std::int64_t UnixTimes::Convert(std::int64_t utime, std::int64_t from, std::int64_t to) const {
  const auto one = ahead_.find(from);
  const auto other = ahead_.find(to);
  if (from == to || one == ahead_.end() || other == ahead_.end()) return utime;
  if (utime < 0 || utime > kLatest / kMicrosecond) return utime;
  return utime - (one->second - other->second) / kMicrosecond;
}

std::vector<std::string> UtcFaults(const MachineView& machine, MonoNs now) {
  std::vector<std::string> faults;
  const std::vector<HostView>& hosts = machine.hosts();
  for (std::size_t i = 0; i < hosts.size(); ++i) {
    const HostView& host = hosts[i];
    if (!host.Claims(now)) continue;
    const auto to_root = DifferenceToRoot(machine, host, now);
    if (to_root && std::abs(to_root->ns) - to_root->width_ns > kMaxDifference) {
      faults.push_back(ClockFault(host.name, machine.time_root(), *to_root));
    }
    for (std::size_t j = i + 1; j < hosts.size(); ++j) {
      if (!hosts[j].Claims(now) || !HaveOneReference(host, hosts[j])) continue;
      const auto difference = Difference(host.quality, hosts[j].quality);
      const std::int64_t claimed = host.quality.utc_half_width_ns + hosts[j].quality.utc_half_width_ns;
      if (difference && std::abs(difference->ns) > difference->width_ns + claimed) {
        faults.push_back(ClaimFault(host, hosts[j], *difference));
      }
    }
  }
  return faults;
}

}  // namespace axlecast
