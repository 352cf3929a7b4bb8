#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

#include "core/config/load.h"

namespace axlecast {

// Returns the machine of a file with this text. Fails the test if the file has errors.
inline MachineConfig MachineFromText(const std::string& text) {
  ConfigErrors errors("test.yaml");
  std::optional<MachineConfig> machine = ParseConfig(text, errors);
  EXPECT_TRUE(machine) << errors.Text();
  return machine ? std::move(*machine) : MachineConfig{};
}

// Returns the errors of a file with this text; empty if it has none.
inline std::string ErrorsOfText(const std::string& text) {
  ConfigErrors errors("test.yaml");
  static_cast<void>(ParseConfig(text, errors));
  return errors.Text();
}

}  // namespace axlecast
