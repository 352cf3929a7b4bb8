#pragma once

#include <gtest/gtest.h>
#include <optional>
#include <string>
#include <utility>

#include "core/config/load.h"

namespace axlecast::saa_can {

// A machine with one bus, `keys` of the bus beside its family ("bench: true, "), and `devices`.
inline std::string MachineText(const std::string& keys, const std::string& devices) {
  return "machine: test\nbuses:\n  can-0: {family: saa_can, " + keys + "devices: {" + devices + "}}\n";
}

// As a driver would have it. Fails the test when the text is refused.
inline MachineConfig LoadMachine(const std::string& keys, const std::string& devices) {
  ConfigErrors errors("test.yaml");
  std::optional<MachineConfig> machine = ParseConfig(MachineText(keys, devices), errors);
  EXPECT_TRUE(machine) << errors.Text();
  return machine ? std::move(*machine) : MachineConfig{};
}

// Returns the errors of the file; empty if there are no errors.
inline std::string ProblemOf(const std::string& keys, const std::string& devices) {
  ConfigErrors errors("test.yaml");
  static_cast<void>(ParseConfig(MachineText(keys, devices), errors));
  return errors.Text();
}

inline constexpr const char* kSimulated = "simulate: true, ";
inline constexpr const char* kReal = "link: {iface: can0}, ";

}  // namespace axlecast::saa_can
