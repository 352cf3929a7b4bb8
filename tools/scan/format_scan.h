#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/scan/scan.h"

namespace axlecast {

// Where a scan looked, and how what it writes shall be called.
struct ScanPlace {
  std::string port;  // as the operator named it: port, interface or spidev
  ScanLineKind kind = ScanLineKind::kSerial;
  std::string machine = "scanned";
  std::string bus = "bus1";
  bool echo = false;  // the adapter hears its own transmission
};

// "19200 baud 8N1", "1.0 MHz"; empty where the trial sets nothing.
[[nodiscard]] std::string LineText(const ProbeTrial& trial, ScanLineKind kind);

// A machine's file with the devices that belong on one bus with the surest of them; empty: there is none that could be
// configured.
[[nodiscard]] std::string ScanYaml(const ScanPlace& place, const ScanReport& report);

// For people, but for the file.
[[nodiscard]] std::string ScanText(const ScanPlace& place, const ScanReport& report);
// One object: port, complete, asked, found, notes, yaml.
[[nodiscard]] nlohmann::ordered_json ScanJson(const ScanPlace& place, const ScanReport& report);

}  // namespace axlecast
