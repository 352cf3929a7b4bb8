#include "tests/conformance/example_buses.h"

#include <algorithm>
#include <filesystem>

namespace axlecast {
namespace {

std::vector<ExampleBus> FindExamples() {
  std::vector<ExampleBus> examples;
  for (const Family* family : Families()) {
    const std::string file = std::string(AXLECAST_SOURCE "/drivers/") + std::string(family->name) + "/example.yaml";
    ConfigErrors errors(file);
    const auto machine = LoadConfig(file, errors);
    // A file that is missing or wrong is shown by its test.
    if (!machine) examples.push_back({std::string(family->name), file, ""});
    if (!machine) continue;
    for (const BusConfig& bus : machine->buses) examples.push_back({std::string(family->name), file, bus.name});
  }
  return examples;
}

}  // namespace

const std::vector<ExampleBus>& ExampleBuses() {
  static const std::vector<ExampleBus> kExamples = FindExamples();
  return kExamples;
}

std::string NameOf(const testing::TestParamInfo<ExampleBus>& info) {
  std::string name = info.param.family + '_' + info.param.bus;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

ExampleTest::ExampleTest() {
  ConfigErrors errors(GetParam().file);
  auto machine = LoadConfig(GetParam().file, errors);
  EXPECT_TRUE(machine) << errors.Text();
  if (!machine) return;
  machine_ = std::make_unique<MachineConfig>(std::move(*machine));
  for (BusConfig& bus : machine_->buses) bus.capture = true;
  bus_ = machine_->FindBus(GetParam().bus);
  simulator_ = MakeSimulator(*machine_, *bus_, errors);
  EXPECT_TRUE(simulator_) << errors.Text();
  secrets_.any = "password";
}

}  // namespace axlecast
