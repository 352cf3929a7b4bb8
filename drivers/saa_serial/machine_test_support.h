#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

#include "core/config/load.h"

namespace axlecast::saa_serial {

// A machine with one bus, `keys` of the bus beside its family, and `devices`.
inline std::string MachineText(const std::string& keys, const std::string& devices) {
  return "machine: test\nbuses:\n  b: {family: saa_serial, " + keys + ", devices: {" + devices + "}}\n";
}

// The bus as the driver would have it. Fails the test when the text is refused.
inline MachineConfig LoadMachine(const std::string& keys, const std::string& devices) {
  ConfigErrors errors("test.yaml");
  std::optional<MachineConfig> machine = ParseConfig(MachineText(keys, devices), errors);
  EXPECT_TRUE(machine) << errors.Text();
  return machine ? std::move(*machine) : MachineConfig{};
}

// The errors; empty if there are none.
inline std::string ProblemOf(const std::string& keys, const std::string& devices) {
  ConfigErrors errors("test.yaml");
  static_cast<void>(ParseConfig(MachineText(keys, devices), errors));
  return errors.Text();
}

}  // namespace axlecast::saa_serial
