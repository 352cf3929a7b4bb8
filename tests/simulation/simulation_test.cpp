#include <gtest/gtest.h>

#include "tests/simulation/simulated_machine.h"
#include "tests/support/thorough.h"

namespace axlecast::simulation {
namespace {

constexpr MonoNs kMinute = 60 * kSecond;

void ExpectNoBreach(const SimulatedMachine& machine) {
  for (const std::string& breach : machine.promises().breaches()) ADD_FAILURE() << breach;
}
std::int64_t CountOf(const SimulatedMachine& machine, const std::string& what) {
  const auto found = machine.promises().counts().find(what);
  return found == machine.promises().counts().end() ? 0 : found->second;
}

TEST(Simulation, WithoutFaultsEverythingIsReadAndDone) {
  const MachineConfig config = ReadSimulatedMachine();
  SimulatedMachine machine(config, 1);
  machine.Run(Times(30, 2) * kSecond, {});
  ExpectNoBreach(machine);
  EXPECT_GT(CountOf(machine, "positions compared with their shaft"), 3'000);
  EXPECT_GT(CountOf(machine, "instants compared on the time base"), 3'000);
  EXPECT_GT(CountOf(machine, "log events compared with what arrived"), 5'000);
  EXPECT_GT(CountOf(machine, "commands that ended as succeeded"), 2);
}

TEST(Simulation, WithFaultsOfEveryKindAllPromisesHold) {
  const MachineConfig config = ReadSimulatedMachine();
  SimulatedMachine machine(config, 2);
  const auto faults = DrawFaults(2, SimulatedMachine::kRunIn, SimulatedMachine::kRunIn + Times(4, 4) * kMinute);
  machine.Run(Times(4, 4) * kMinute, faults);
  ExpectNoBreach(machine);
  EXPECT_GT(CountOf(machine, "faults"), 10);
}

TEST(Simulation, OneSeedIsOneRun) {
  const MachineConfig config = ReadSimulatedMachine();
  const auto faults = DrawFaults(3, SimulatedMachine::kRunIn, SimulatedMachine::kRunIn + 5 * kSecond);
  SimulatedMachine one(config, 3);
  one.Run(5 * kSecond, faults);
  SimulatedMachine other(config, 3);
  other.Run(5 * kSecond, faults);
  EXPECT_EQ(one.promises().counts(), other.promises().counts());
}

}  // namespace
}  // namespace axlecast::simulation
