#include "tests/simulation/fault_plan.h"

#include <algorithm>

#include "core/base/text.h"
#include "tests/simulation/promises.h"
#include "tests/simulation/random.h"

namespace axlecast::simulation {

using K = FaultKind;

const std::array<FaultSpec, 31> kFaults = {{
    {K::kDriverKill, "driver killed", 80, 100 * kMillisecond, 3 * kSecond},
    {K::kDriverFreeze, "driver frozen", 80, 5 * kMillisecond, 3 * kSecond},
    {K::kBridgeKill, "bridge killed", 30, 100 * kMillisecond, 5 * kSecond},
    {K::kBridgePowerCut, "bridge without power", 20, 500 * kMillisecond, 10 * kSecond},
    {K::kBridgeFreeze, "bridge frozen", 20, 10 * kMillisecond, 5 * kSecond},
    {K::kJournalStall, "journal's disk stalled", 20, 20 * kMillisecond, 8 * kSecond},
    {K::kRecorderKill, "recorder killed", 10, 100 * kMillisecond, 3 * kSecond},
    {K::kRecorderPowerCut, "recorder without power", 10, 500 * kMillisecond, 5 * kSecond},
    {K::kTimeKill, "time service killed", 20, 100 * kMillisecond, 5 * kSecond},
    {K::kTimeFreeze, "time service frozen", 20, 50 * kMillisecond, 5 * kSecond},
    {K::kClientDies, "client dies", 90, 0, 2 * kSecond},
    {K::kCancel, "command given up", 90, 0, 2 * kSecond},
    {K::kAlarmNames, "alarm names invented", 20, 0, 0},
    {K::kNetworkLoss, "network loses", 30, kSecond, 30 * kSecond},
    {K::kDuplication, "network doubles", 20, kSecond, 30 * kSecond},
    {K::kReordering, "network delays and reorders", 20, kSecond, 30 * kSecond},
    {K::kPartition, "hosts parted", 15, 200 * kMillisecond, 20 * kSecond},
    {K::kAsymmetry, "one direction delayed", 10, kSecond, 60 * kSecond},
    {K::kUnplug, "cable unplugged", 40, 10 * kMillisecond, 8 * kSecond},
    {K::kNoise, "noise on a cable", 40, kSecond, 20 * kSecond},
    {K::kLostReplies, "replies lost", 40, kSecond, 20 * kSecond},
    {K::kStrayBytes, "stray bytes", 30, kSecond, 20 * kSecond},
    {K::kLateReplies, "late replies", 40, kSecond, 20 * kSecond},
    {K::kOvertakingReplies, "late replies that overtake", 30, kSecond, 20 * kSecond},
    {K::kDevicePower, "device without power", 30, 50 * kMillisecond, 8 * kSecond},
    {K::kDeviceSilent, "device silent", 30, 50 * kMillisecond, 8 * kSecond},
    {K::kDeviceGarbage, "device sends garbage", 20, 50 * kMillisecond, 5 * kSecond},
    {K::kSpeed, "shaft at another speed", 120, 0, 0},
    {K::kUtcStep, "UNIX time stepped", 20, 0, 0},
    {K::kSlew, "clock slewed", 30, kSecond, 60 * kSecond},
    {K::kStarvation, "host starved", 25, kSecond, 20 * kSecond},
}};

const FaultSpec& SpecOf(FaultKind kind) {
  return *std::find_if(kFaults.begin(), kFaults.end(), [kind](const FaultSpec& spec) { return spec.kind == kind; });
}

std::vector<Fault> DrawFaults(std::uint64_t seed, MonoNs from, MonoNs until) {
  std::vector<Fault> faults;
  for (const FaultSpec& spec : kFaults) {
    Random random(seed, 1'000 + static_cast<std::uint64_t>(spec.kind));
    const auto mean = static_cast<MonoNs>(3'600e9 / spec.per_hour);
    for (MonoNs at = from + random.Delay(mean); at < until; at += random.Delay(mean)) {
      const MonoNs lasts = std::min(random.Time(spec.least, spec.most), until - at);
      faults.push_back({spec.kind, at, lasts, random.Next(), random.Share()});
    }
  }
  std::sort(faults.begin(), faults.end(), [](const Fault& one, const Fault& other) { return one.at < other.at; });
  return faults;
}

std::string FaultText(const Fault& fault) {
  return Promises::TimeText(fault.at) + "  " + SpecOf(fault.kind).name +
         Text(", part %u, amount %.2f, for %.3f s", static_cast<unsigned>(fault.target % 1'000), fault.amount,
              static_cast<double>(fault.lasts) * 1e-9);
}

}  // namespace axlecast::simulation
