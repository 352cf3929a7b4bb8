#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/scan/scan.h"

namespace axlecast {

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
