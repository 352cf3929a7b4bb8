#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/device/family.h"
#include "core/device/probe.h"
#include "drivers/runtime/bus/transactor.h"

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

// The line that is looked at, open. tools/scan has one for each kind.
class ScanLine {
 public:
  virtual ~ScanLine() = default;

  // Sets it as the trial wants it; false when port or adapter cannot.
  [[nodiscard]] virtual bool Set(const ProbeTrial& trial) = 0;
  [[nodiscard]] virtual Transactor& medium() = 0;
};

struct ScanHooks {
  std::function<bool()> stop = [] { return false; };  // asked before every step
  // Whether anything may be sent: asked once, before the first trial that asks, of a line that is quiet.
  std::function<bool()> may_ask = [] { return false; };
  // What is being tried, how much of it is done, and how long the rest takes at most.
  std::function<void(const PlannedTrial& trial, double done, MonoNs left)> progress = [](const PlannedTrial&,
                                                                                         double, MonoNs) {};
};

struct FoundDevice {
  const Family* family = nullptr;
  ProbeTrial trial;  // that found it
  ProbeHit finding;
};

struct ScanReport {
  std::vector<FoundDevice> found;
  std::vector<std::string> notes;  // what was not tried, and why
  bool asked = false;              // something was sent
  bool complete = true;            // false: stopped, or the line was lost
};

// Tries the plan. It listens whether anything speaks: then only trials that listen are made; on a quiet line only those
// that ask, after may_ask. Once something is found, only trials go on that could find its neighbours: those of the same
// family at the same rate.
[[nodiscard]] ScanReport RunScan(ScanLine& line, const Clock& clock, std::vector<PlannedTrial> plan,
                                 const ScanHooks& hooks);

}  // namespace axlecast
