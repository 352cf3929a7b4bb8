#include "tests/command_simulation/world.h"

#include <gtest/gtest.h>

#include "tests/support/thorough.h"

namespace axlecast {
namespace {

WorldTally RunAndJudge(World& world, std::uint32_t count) {
  EXPECT_TRUE(world.Run(count)) << "it takes for ever";
  const WorldTally tally = world.Judge();
  for (const std::string& breach : tally.breaches) ADD_FAILURE() << breach;
  return tally;
}

int Of(const WorldTally& tally, const std::string& outcome) {
  const auto found = tally.outcomes.find(outcome);
  return found == tally.outcomes.end() ? 0 : found->second;
}

TEST(CommandSimulation, OnAGoodNetworkEverythingEndsAsTheDeviceSays) {
  World world({.seed = 1});
  const WorldTally tally = RunAndJudge(world, 1'000);
  EXPECT_EQ(Of(tally, "succeeded"), tally.effects);
  EXPECT_EQ(Of(tally, "indeterminate"), 0);
  EXPECT_GT(Of(tally, "failed"), 50);
  EXPECT_GT(Of(tally, "rejected"), 50);
}

TEST(CommandSimulation, ThroughALossyNetwork) {
  World world({.seed = 2,
               .network = {.loss = 0.3, .duplication = 0.1, .max_delay_ms = 30},
               .client_kills = 0.1,
               .cancels = 0.1,
               .short_lived = 0.1,
               .reads = 0.1});
  constexpr std::uint32_t kCommands = Times(2'000U, 2U);
  const WorldTally tally = RunAndJudge(world, kCommands);
  EXPECT_GT(Of(tally, "succeeded"), kCommands / 2);
  EXPECT_GT(Of(tally, "expired") + Of(tally, "never accepted"), 10);
  EXPECT_GT(Of(tally, "cancelled"), 10);
}

TEST(CommandSimulation, KilledAtAnyMoment) {
  World world({.seed = 3,
               .network = {.loss = 0.3, .duplication = 0.1, .max_delay_ms = 30},
               .driver_kills_per_s = 0.2,
               .bridge_kills_per_s = 0.3,
               .client_kills = 0.1,
               .cancels = 0.05,
               .short_lived = 0.05});
  const WorldTally tally = RunAndJudge(world, Times(2'000U, 2U));
  EXPECT_GT(Of(tally, "indeterminate"), 5);
  EXPECT_GT(tally.bridge_kills, 3);
  EXPECT_GT(tally.driver_kills, 3);
}

TEST(CommandSimulation, ANetworkThatAlmostFails) {
  World world({.seed = 4, .network = {.loss = 0.8, .duplication = 0.1, .max_delay_ms = 200}, .buses = 2});
  RunAndJudge(world, 200);
}

// Every transition of the bridge, and of a driver, once: the instants before and after each thing that it writes
// into the journal, sends, or does to a device.

constexpr std::uint32_t kScene = 6;  // commands

WorldSettings Scene(std::uint32_t seed) {
  return {.seed = seed, .buses = 1, .devices_per_bus = 2, .cancels = 0.2, .reads = 0.2};
}

TEST(CommandKills, TheBridgeAtEachOfItsTransitions) {
  for (std::uint32_t seed = 1; seed <= Times(3U, 3U); ++seed) {
    World whole(Scene(seed));
    RunAndJudge(whole, kScene);
    ASSERT_GT(whole.bridge_faults.count(), 60);
    for (std::int64_t at = 0; at < whole.bridge_faults.count(); ++at) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", transition " + std::to_string(at));
      World world(Scene(seed));
      world.bridge_faults.KillAt(at);
      EXPECT_EQ(RunAndJudge(world, kScene).bridge_kills, 1);
    }
  }
}

TEST(CommandKills, ADriverAtEachOfItsTransitions) {
  for (std::uint32_t seed = 1; seed <= Times(3U, 3U); ++seed) {
    World whole(Scene(seed));
    RunAndJudge(whole, kScene);
    const std::int64_t transitions = whole.driver_faults("b0").count();
    ASSERT_GT(transitions, 30);
    for (std::int64_t at = 0; at < transitions; ++at) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", transition " + std::to_string(at));
      World world(Scene(seed));
      world.driver_faults("b0").KillAt(at);
      EXPECT_EQ(RunAndJudge(world, kScene).driver_kills, 1);
    }
  }
}

TEST(CommandKills, BothOneAfterTheOther) {
  constexpr std::int64_t kStep = kAllValues ? 5 : 13;
  World whole(Scene(7));
  RunAndJudge(whole, kScene);
  for (std::int64_t at = 0; at < whole.bridge_faults.count(); at += kStep) {
    for (std::int64_t driver_at = 0; driver_at < whole.driver_faults("b0").count(); driver_at += kStep) {
      SCOPED_TRACE("transition " + std::to_string(at) + " and " + std::to_string(driver_at));
      World world(Scene(7));
      world.bridge_faults.KillAt(at);
      world.driver_faults("b0").KillAt(driver_at);
      RunAndJudge(world, kScene);
    }
  }
}

}  // namespace
}  // namespace axlecast
