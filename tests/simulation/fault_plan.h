#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/time.h"

namespace axlecast::simulation {

enum class FaultKind : std::uint8_t {
  kDriverKill,
  kDriverFreeze,
  kBridgeKill,
  kBridgePowerCut,
  kBridgeFreeze,
  kJournalStall,
  kRecorderKill,
  kRecorderPowerCut,
  kTimeKill,
  kTimeFreeze,
  kClientDies,
  kCancel,
  kAlarmNames,
  kNetworkLoss,
  kDuplication,
  kReordering,
  kPartition,
  kAsymmetry,
  kUnplug,
  kNoise,
  kLostReplies,
  kStrayBytes,
  kLateReplies,
  kOvertakingReplies,
  kDevicePower,
  kDeviceSilent,
  kDeviceGarbage,
  kSpeed,
  kUtcStep,
  kSlew,
  kStarvation,
};

// What can happen, how often, and for how long.
struct FaultSpec {
  FaultKind kind;
  const char* name;
  double per_hour;  // of the whole machine
  MonoNs least;     // duration
  MonoNs most;
};
extern const std::array<FaultSpec, 31> kFaults;
[[nodiscard]] const FaultSpec& SpecOf(FaultKind kind);

struct Fault {
  FaultKind kind;
  MonoNs at = 0;  // of the schedule
  MonoNs lasts = 0;
  std::uint64_t target = 0;  // any number: the simulation takes it modulo the number of its parts of this kind
  double amount = 0;         // 0 to 1: its strength
};

// Draws the faults of a run: repeatable by its seed.
[[nodiscard]] std::vector<Fault> DrawFaults(std::uint64_t seed, MonoNs from, MonoNs until);
// "12.345 s  bridge killed, 1.2 s"
[[nodiscard]] std::string FaultText(const Fault& fault);

}  // namespace axlecast::simulation
