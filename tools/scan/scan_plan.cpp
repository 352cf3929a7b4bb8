#include "tools/scan/scan_plan.h"

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

ScanLineKind KindOf(LinkKind link) {
  switch (link) {
    case LinkKind::kCan:
      return ScanLineKind::kCan;
    case LinkKind::kSpi:
      return ScanLineKind::kSpi;
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return ScanLineKind::kSerial;
}

}  // namespace

std::vector<PlannedTrial> PlanScan(std::span<const FamilyProbe> probes, ScanLineKind kind,
                                   const ProbeScope& scope) {
  std::vector<PlannedTrial> plan;
  for (const FamilyProbe& probe : probes) {
    if (KindOf(probe.family->link) != kind) continue;
    for (ProbeTrial& trial : probe.trials(scope)) plan.push_back({probe.family, std::move(trial)});
  }
  std::stable_sort(plan.begin(), plan.end(), [](const PlannedTrial& a, const PlannedTrial& b) {
    if (a.trial.asks != b.trial.asks) return b.trial.asks;
    return a.trial.asks && a.trial.longest < b.trial.longest;
  });
  return plan;
}

MonoNs LongestOf(std::span<const PlannedTrial> trials) {
  MonoNs longest = 0;
  for (const PlannedTrial& planned : trials) longest += planned.trial.longest;
  return longest;
}

}  // namespace axlecast
