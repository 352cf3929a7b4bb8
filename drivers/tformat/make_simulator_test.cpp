#include "drivers/tformat/make_simulator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <yaml-cpp/yaml.h>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast::tformat {
namespace {

using testing::HasSubstr;

constexpr MonoNs kStart = 100 * kSecond;

class SimulatorScriptTest : public testing::Test {
 protected:
  SimulatorScriptTest() {
    bus_.name = "rs485-0";
    bus_.devices.emplace_back();
    bus_.devices.front().name = "axis1";
  }

  // The simulator of this mapping, started at kStart; its errors.
  std::string Make(const std::string& yaml) {
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load(yaml), "simulate", errors);
    simulator_ = MakeTFormatSimulator(bus_, map);
    map.Done();
    if (simulator_) simulator_->OnDue(kStart, [](Bytes) {});
    return errors.Text();
  }
  void RunUntil(MonoNs until) {
    while (simulator_->NextDue() <= until) simulator_->OnDue(simulator_->NextDue(), [](Bytes) {});
    simulator_->OnDue(until, [](Bytes) {});
  }
  std::string Value(const std::string& key, MonoNs at) {
    for (const auto& [name, value] : simulator_->State("axis1", at)) {
      if (name == key) return value;
    }
    return "absent";
  }

  BusConfig bus_;
  std::unique_ptr<Simulator> simulator_;
};

TEST_F(SimulatorScriptTest, WithoutKeysItStandsAtZeroAtTheWiresPace) {
  ASSERT_EQ(Make("{}"), "");
  EXPECT_EQ(Value("speed_rpm", kStart), "0");
  EXPECT_EQ(Value("pace", kStart), "wire");
  EXPECT_EQ(Value("battery_v", kStart), "3.6");
  EXPECT_EQ(Value("enid", kStart), "17");
  EXPECT_EQ(Value("single_turn", kStart), "0");
}

TEST_F(SimulatorScriptTest, StepsHappenAtTheirInstants) {
  ASSERT_EQ(
      Make("axis1:\n"
           "  {speed_rpm: 60, start_deg: 10, battery_v: 3.6, pace: wire,\n"
           "   script: [{at_s: 5, battery_v: 3.0}, {at_s: 9, fault: bit_flip:0.001}, {at_s: 12, fault: none}]}\n"),
      "");
  EXPECT_NEAR(std::stod(Value("angle_deg", kStart)), 10, 1e-6);
  RunUntil(kStart + 5 * kSecond - 1);
  EXPECT_EQ(Value("alarms", kStart + 5 * kSecond - 1), "none");
  EXPECT_EQ(simulator_->NextDue(), kStart + 5 * kSecond);
  RunUntil(kStart + 5 * kSecond);
  EXPECT_EQ(Value("alarms", kStart + 5 * kSecond), "BA");
  RunUntil(kStart + 10 * kSecond);
  EXPECT_EQ(Value("fault", kStart + 10 * kSecond), "bit_flip:0.001");
  RunUntil(kStart + 100 * kSecond);
  EXPECT_EQ(Value("fault", kStart + 100 * kSecond), "none");
  EXPECT_EQ(simulator_->NextDue(), kNever);
}

TEST_F(SimulatorScriptTest, AStepThatIsServedLateStillActsAtItsInstant) {
  ASSERT_EQ(Make("axis1: {accel_rad_s2: 200000, script: [{at_s: 1, speed_rpm: 60}]}"), "");
  simulator_->OnDue(kStart + 11 * kSecond, [](Bytes) {});
  EXPECT_NEAR(std::stod(Value("angle_deg", kStart + 11 * kSecond)), 3'600, 0.1);
}

TEST_F(SimulatorScriptTest, ComesAgainAfterItsPeriod) {
  ASSERT_EQ(Make("axis1: {script_period_s: 10, script: [{at_s: 1, battery_v: 3.0}, {at_s: 2, battery_v: 3.6}]}"),
            "");
  for (int round = 0; round < 3; ++round) {
    const MonoNs begin = kStart + round * 10 * kSecond;
    RunUntil(begin + 1'500 * kMillisecond);
    EXPECT_EQ(Value("battery_v", begin + 1'500 * kMillisecond), "3") << round;
    RunUntil(begin + 9 * kSecond);
    EXPECT_EQ(Value("battery_v", begin + 9 * kSecond), "3.6") << round;
  }
}

// As in the demo: the battery-backed counter turned too fast while off, then powered on.
TEST_F(SimulatorScriptTest, AnOverSpeedDevelops) {
  ASSERT_EQ(Make("axis1: {script: [{at_s: 1, power: off}, {at_s: 2, speed_rpm: 7000}, {at_s: 4, speed_rpm: 50},\n"
                 "                 {at_s: 6, power: on}]}"),
            "");
  RunUntil(kStart + 8 * kSecond);
  EXPECT_EQ(Value("alarms", kStart + 8 * kSecond), "OS");
}

TEST_F(SimulatorScriptTest, AnOverflowDevelops) {
  ASSERT_EQ(Make("axis1: {start_turns: 65535, start_deg: 180, speed_rpm: 60}"), "");
  EXPECT_EQ(Value("alarms", kStart), "none");
  EXPECT_EQ(Value("multi_turn", kStart), "65535");
  EXPECT_EQ(Value("alarms", kStart + kSecond), "OF");
  EXPECT_EQ(Value("multi_turn", kStart + kSecond), "0");
}

TEST_F(SimulatorScriptTest, MistakesAreNamedWithTheirLine) {
  EXPECT_THAT(Make("axis1:\n  speed: 60\n"), HasSubstr("machine.yaml:2:"));
  EXPECT_THAT(Make("axis1:\n  sped_rpm: 60\n"), HasSubstr("did you mean 'speed_rpm'"));
  EXPECT_THAT(Make("axis1:\n  pace: wire\n  battery_v: 12\n"),
              HasSubstr("machine.yaml:3:14: simulate.axis1.battery_v: '12'"));
  EXPECT_THAT(Make("axis1: {script: [{battery_v: 3}]}"), HasSubstr("at_s: is missing"));
  EXPECT_THAT(Make("axis1: {script: [{at_s: 2, power: off}, {at_s: 1, power: on}]}"), HasSubstr("in the order"));
  EXPECT_THAT(Make("axis1: {script: [{at_s: 2, start_deg: 1}]}"), HasSubstr("unknown key 'start_deg'"));
  EXPECT_THAT(Make("axis1: {script_period_s: 2, script: [{at_s: 2, power: off}]}"), HasSubstr("later than"));
  EXPECT_THAT(Make("axis1: {motion: stop, speed_rpm: 3}"), HasSubstr("excludes motion"));
  EXPECT_THAT(Make("axis1: {start_turns: 65536}"), HasSubstr("65535"));
  EXPECT_THAT(Make("axis9: {speed_rpm: 60}"), HasSubstr("unknown key 'axis9'"));
}

}  // namespace
}  // namespace axlecast::tformat
