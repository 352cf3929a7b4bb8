#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "drivers/runtime/bus/transactor.h"
#include "tools/scan/scan_plan.h"

namespace axlecast {

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
