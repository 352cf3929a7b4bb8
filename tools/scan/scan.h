#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/device/family.h"
#include "core/device/probe.h"
#include "drivers/runtime/bus/transactor.h"

namespace axlecast {

// The kind of line. A serial port may carry the bytes of Modbus or of any other family.
enum class ScanLineKind : std::uint8_t { kSerial, kCan, kSpi };

struct PlannedTrial {
  const Family* family = nullptr;
  ProbeTrial trial;
};

// Returns all trials for such a line: those that only receive, then those that transmit, the shortest first.
[[nodiscard]] std::vector<PlannedTrial> PlanScan(std::span<const FamilyProbe> probes, ScanLineKind kind,
                                                 const ProbeScope& scope);

// The open line of a scan. scan_lines.h has a class for each kind.
class ScanLine {
 public:
  virtual ~ScanLine() = default;

  // Sets the line for the trial. Returns false if the port or the adapter does not support it.
  [[nodiscard]] virtual bool Set(const ProbeTrial& trial) = 0;
  [[nodiscard]] virtual Transactor& transactor() = 0;
};

struct ScanHooks {
  std::function<bool()> stop = [] { return false; };  // called before every step; true ends the scan
  // Returns whether the scan may transmit. Called once, on a quiet line, before the first trial that transmits.
  std::function<bool()> may_ask = [] { return false; };
  // Reports the current trial, its finished part, 0 to 1, and the maximum remaining time of the scan.
  std::function<void(const PlannedTrial& trial, double done, MonoNs left)> progress = [](const PlannedTrial&,
                                                                                         double, MonoNs) {};
};

struct FoundDevice {
  const Family* family = nullptr;
  ProbeTrial trial;  // that found the device
  ProbeHit finding;
};

struct ScanReport {
  std::vector<FoundDevice> found;
  std::vector<std::string> notes;  // trials that were not made, and why
  bool asked = false;              // the scan transmitted
  bool complete = true;            // false: it was stopped, or the line was lost
};

// Runs the trials of the plan. If anything is received unasked, only trials that receive are made. On a quiet line, only
// trials that transmit are made, after may_ask. After a hit, only trials of the same family at the same rate follow: they can
// find its neighbours.
[[nodiscard]] ScanReport RunScan(ScanLine& line, const Clock& clock, std::vector<PlannedTrial> plan,
                                 const ScanHooks& hooks);

// The port of a scan, and the names in the file that it writes.
struct ScanPlace {
  std::string port;  // as the operator typed it: port, interface or spidev
  ScanLineKind kind = ScanLineKind::kSerial;
  std::string machine = "scanned";
  std::string bus = "bus1";
  bool echo = false;  // the adapter receives its own transmission
};

// Formats the settings of the line: "19200 baud 8N1", "1.0 MHz". A trial that sets nothing has no text.
[[nodiscard]] std::string LineText(const ProbeTrial& trial, ScanLineKind kind);

// Formats a machine's file with the device of the highest confidence and the other devices on its bus. Returns no text without
// a device that can be configured.
[[nodiscard]] std::string ScanYaml(const ScanPlace& place, const ScanReport& report);

// Formats the hits and notes for the operator, without the file.
[[nodiscard]] std::string ScanText(const ScanPlace& place, const ScanReport& report);
// Returns one object: port, complete, asked, found, notes, yaml.
[[nodiscard]] nlohmann::ordered_json ScanJson(const ScanPlace& place, const ScanReport& report);

}  // namespace axlecast
