#pragma once

#include <string>

#include "tests/support/machine_text.h"

namespace axlecast::saa_serial {

// A machine with one bus, `keys` of the bus beside its family, and `devices`.
inline std::string MachineText(const std::string& keys, const std::string& devices) {
  return "machine: test\nbuses:\n  b: {family: saa_serial, " + keys + ", devices: {" + devices + "}}\n";
}

// The bus as the driver would have it. Fails the test when the text is refused.
inline MachineConfig LoadMachine(const std::string& keys, const std::string& devices) {
  return MachineFromText(MachineText(keys, devices));
}

// The errors; empty if there are none.
inline std::string ProblemOf(const std::string& keys, const std::string& devices) {
  return ErrorsOfText(MachineText(keys, devices));
}

}  // namespace axlecast::saa_serial
