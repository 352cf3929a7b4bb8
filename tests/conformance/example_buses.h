#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/config/load.h"
#include "tests/support/fixed_secrets.h"

namespace axlecast {

// One bus of a family's example.yaml.
struct ExampleBus {
  std::string family;
  std::string file;
  std::string bus;
};
[[nodiscard]] const std::vector<ExampleBus>& ExampleBuses();
[[nodiscard]] std::string NameOf(const testing::TestParamInfo<ExampleBus>& info);
inline void PrintTo(const ExampleBus& example, std::ostream* stream) { *stream << example.file; }

// The bus with the simulator that the file describes.
class ExampleTest : public testing::TestWithParam<ExampleBus> {
 protected:
  ExampleTest();

  std::unique_ptr<MachineConfig> machine_;
  const BusConfig* bus_ = nullptr;
  std::unique_ptr<Simulator> simulator_;
  FixedSecrets secrets_;  // every file that the example names holds the simulators' default password
};

}  // namespace axlecast
