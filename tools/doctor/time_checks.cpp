#include "tools/doctor/check.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>
#include <string_view>

#include "core/base/text.h"
#include "core/time/utc_claim.h"

namespace axlecast {
namespace {

constexpr std::int64_t kDriverMemory = 32 << 20;  // bytes of a driver with all its pages locked, with a margin
constexpr double kFastHz = 1'000;                 // from this poll rate on, a late wake-up costs a slot
constexpr const char* kLimitsFile = "/etc/security/limits.d/axlecast.conf";

template <std::size_t Size>
bool IsOneOf(std::string_view text, const std::array<std::string_view, Size>& words) {
  return std::ranges::find(words, text) != words.end();
}

// `ranges`: like "0-3,6", from /sys/devices/system/cpu/online.
bool IsOnline(const std::string& ranges, int cpu) {
  std::istringstream list(ranges);
  for (std::string range; std::getline(list, range, ',');) {
    int first = 0;
    const char* const end = range.data() + range.size();
    const auto [rest, error] = std::from_chars(range.data(), end, first);
    if (error != std::errc()) continue;
    int last = first;
    if (rest != end && *rest == '-') std::from_chars(rest + 1, end, last);
    if (first <= cpu && cpu <= last) return true;
  }
  return false;
}

// Returns true if a late wake-up affects the readings of this machine.
bool IsFast(const MachineConfig& machine) {
  return std::ranges::any_of(machine.buses, [](const BusConfig& bus) {
    return !bus.simulate && (bus.realtime.priority > 0 || bus.poll_hz >= kFastHz);
  });
}

const HostProcess* KeeperOfUtc(const HostFacts& host) {
  // As truncated in /proc/PID/comm.
  static constexpr std::array<std::string_view, 6> kKeepers = {"systemd-timesyn", "chronyd", "ntpd",
                                                               "ntpsec",          "phc2sys", "ptp4l"};
  const auto keeper = std::ranges::find_if(
      host.processes, [](const HostProcess& process) { return IsOneOf(process.name, kKeepers); });
  return keeper == host.processes.end() ? nullptr : &*keeper;
}

Symptoms CheckRealtimePriority(const MachineConfig& machine, const HostFacts& host) {
  int needed = 0;
  for (const BusConfig& bus : machine.buses) needed = std::max(needed, bus.realtime.priority);
  if (needed <= host.limits.priority) return {};
  const std::string priority = std::to_string(needed);
  return {{.found = "the machine file requests priority " + priority + ", the limit of this user is " +
                    std::to_string(host.limits.priority),
           .fixes = {Manual("LimitRTPRIO=" + priority +
                            "    # in the [Service] section of the drivers' unit; for users:"),
                     Append(kLimitsFile, "@axlecast - rtprio " + priority)}}};
}

Symptoms CheckRealtimeMemory(const MachineConfig& machine, const HostFacts& host) {
  const bool needed =
      std::ranges::any_of(machine.buses, [](const BusConfig& bus) { return bus.realtime.lock_memory; });
  if (!needed || host.limits.locked_bytes < 0 || host.limits.locked_bytes >= kDriverMemory) return {};
  return {{.found = "the machine file requests locked memory, the limit of this user is " +
                    std::to_string(host.limits.locked_bytes >> 10) + " kB",
           .fixes = {Manual("LimitMEMLOCK=infinity    # in the [Service] section of the drivers' unit; for users:"),
                     Append(kLimitsFile, "@axlecast - memlock unlimited")}}};
}

Symptoms CheckRealtimeCpu(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  for (const BusConfig& bus : machine.buses) {
    const int cpu = bus.realtime.cpu;
    if (cpu < 0 || host.processors.online.empty() || IsOnline(host.processors.online, cpu)) continue;
    symptoms.push_back(
        {.found = "bus " + bus.name + " is bound to processor " + std::to_string(cpu) + "; there are " +
                  host.processors.online,
         .fixes = {Manual("lscpu --extended    # then correct realtime.cpu in the machine's file")}});
  }
  return symptoms;
}

Symptoms CheckCpuGovernor(const MachineConfig& machine, const HostFacts& host) {
  static constexpr std::array<std::string_view, 4> kSlow = {"powersave", "ondemand", "conservative", "schedutil"};
  if (!IsFast(machine)) return {};
  Symptom symptom{.safe = true};
  for (const auto& [path, governor] : host.processors.governors) {
    if (!IsOneOf(governor, kSlow)) continue;
    if (symptom.found.empty()) symptom.found = "processors are clocked by the governor " + governor;
    symptom.fixes.push_back(Write(path, "performance"));
  }
  if (symptom.found.empty()) return {};
  symptom.fixes.push_back(Append("/etc/tmpfiles.d/axlecast-cpu.conf",
                                 "w /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor - - - - performance"));
  return {symptom};
}

Symptoms CheckClockSource(const MachineConfig& machine, const HostFacts& host) {
  static constexpr std::array<std::string_view, 5> kSlow = {"hpet", "acpi_pm", "refined-jiffies", "jiffies", "pit"};
  if (!IsFast(machine) || !IsOneOf(host.processors.clock_source, kSlow)) return {};
  return {
      {.found = "the kernel's clock is " + host.processors.clock_source,
       .fixes = {Manual("dmesg | grep -i -e tsc -e clocksource    # why it is no better one: often a setting of "
                        "the BIOS")}}};
}

Symptoms CheckClockSync(const MachineConfig&, const HostFacts& host) {
  if (const auto& chrony = host.clock.chrony) {
    // A server of a cell may have its own clock as reference.
    if (chrony->FollowsReference() || chrony->reference_id == ChronyTracking::kLocalReference) return {};
    return {{.found = "chronyd runs, but follows no server or reference clock",
             .fixes = {Manual("chronyc sources    # shows its servers")}}};
  }
  if (!host.clock.known || host.clock.synchronised) return {};
  const HostProcess* const keeper = KeeperOfUtc(host);
  if (keeper == nullptr) {
    return {{.found = "nothing keeps this host's clock in step: no timesyncd, chrony or ntpd runs",
             .fixes = {Manual("apt install systemd-timesyncd"), Manual("timedatectl set-ntp true")}}};
  }
  const bool chrony = keeper->name == "chronyd";
  return {{.found = "the clock is not synchronised, though " + keeper->name + " runs",
           .fixes = {Manual(chrony ? "chronyc sources    # shows its servers"
                                   : "timedatectl timesync-status    # shows its server")}}};
}

constexpr auto kChecks = std::to_array<Check>({
    {"realtime_priority", Severity::kWarning, "realtime.priority of the machine file is allowed",
     "The driver runs at normal priority. On a busy host, readings are late.", &CheckRealtimePriority},
    {"realtime_memory", Severity::kWarning, "realtime.lock_memory of the machine file is allowed",
     "The driver's memory may be swapped out. A reading then waits for the disk.", &CheckRealtimeMemory},
    {"realtime_cpu", Severity::kError, "the processors of realtime.cpu exist",
     "The driver runs on any processor, together with other programs.", &CheckRealtimeCpu},
    {"cpu_governor", Severity::kAdvice,
     "if a bus is polled at 1 kHz or has a priority, processors have a constant clock rate",
     "Waking up takes longer until the clock rate has risen. Slots are late.", &CheckCpuGovernor},
    {"clock_source", Severity::kAdvice,
     "if a bus is polled at 1 kHz or has a priority, the kernel has a fast clock source",
     "Reading the clock takes about 1 us instead of 30 ns.", &CheckClockSource},
    {"clock_sync", Severity::kWarning, "a program keeps UNIX time, and follows a server or a reference clock",
     "Timestamps in messages and logs drift, differ between hosts, and may step. Commands of other hosts expire.",
     &CheckClockSync},
});

}  // namespace

std::string ClockText(const HostFacts& host) {
  if (const auto& chrony = host.clock.chrony) {
    const UtcClaim claim = ClaimOfChrony(*chrony, host.clock.utc_ns);
    const std::string from = claim.reference.empty() ? "" : " from " + claim.reference;
    if (claim.half_width_ns < 0) return "kept by chronyd" + from + ", without a claim";
    return "kept by chronyd" + from + ", which claims +-" +
           Text("%.3f", static_cast<double>(claim.half_width_ns) * 1e-6) + " ms";
  }
  if (!host.clock.known || !host.clock.synchronised) return "not kept by a program that the kernel knows of";
  const HostProcess* const keeper = KeeperOfUtc(host);
  return "kept by " + (keeper == nullptr ? "a program that is not visible here" : keeper->name) +
         ", which states no bound of its error";
}

std::span<const Check> TimeChecks() { return kChecks; }

}  // namespace axlecast
