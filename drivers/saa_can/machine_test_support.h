#pragma once

#include <string>

#include "tests/support/machine_text.h"

namespace axlecast::saa_can {

// A machine with one bus, `keys` of the bus beside its family ("bench: true, "), and `devices`.
inline std::string MachineText(const std::string& keys, const std::string& devices) {
  return "machine: test\nbuses:\n  can-0: {family: saa_can, " + keys + "devices: {" + devices + "}}\n";
}

// As a driver would have it. Fails the test when the text is refused.
inline MachineConfig LoadMachine(const std::string& keys, const std::string& devices) {
  return MachineFromText(MachineText(keys, devices));
}

// Returns the errors of the file; empty if there are no errors.
inline std::string ProblemOf(const std::string& keys, const std::string& devices) {
  return ErrorsOfText(MachineText(keys, devices));
}

inline constexpr const char* kSimulated = "simulate: true, ";
inline constexpr const char* kReal = "link: {iface: can0}, ";

}  // namespace axlecast::saa_can
