#pragma once

#include <span>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"

namespace axlecast {

// What a line is to a scan. A serial port may carry Modbus or any other family's bytes.
enum class ScanLineKind : std::uint8_t { kSerial, kCan, kSpi };

struct PlannedTrial {
  const Family* family = nullptr;
  ProbeTrial trial;
};

// Everything that can be tried on such a line: what only listens first, then what asks, the shortest first.
[[nodiscard]] std::vector<PlannedTrial> PlanScan(std::span<const FamilyProbe> probes, ScanLineKind kind,
                                                 const ProbeScope& scope);

// How long the trials take where nothing answers.
[[nodiscard]] MonoNs LongestOf(std::span<const PlannedTrial> trials);

}  // namespace axlecast
