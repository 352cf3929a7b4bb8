// The keys of simulated units in a file.
#include "drivers/tsubaki_sc/simulator/bus_simulator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <yaml-cpp/yaml.h>

#include <tuple>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast::tsubaki_sc {
namespace {

using testing::HasSubstr;

constexpr MonoNs kStart = 1'000'000 * kSecond;  // an uptime of 11 days

class MakeScSimulatorTest : public testing::Test {
 protected:
  std::string Make(const std::string& yaml) {
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load(yaml), "simulate", errors);
    simulator_ = MakeSimulator(bus_, map, units_);
    map.Done();
    if (simulator_) simulator_->OnDue(kStart, [](Bytes) {});
    return errors.Text();
  }
  void RunUntil(MonoNs until) {
    while (simulator_->NextDue() <= until) simulator_->OnDue(simulator_->NextDue(), [](Bytes) {});
  }
  std::string Value(const std::string& unit, const std::string& key, MonoNs at) {
    for (const auto& [name, value] : simulator_->State(unit, at)) {
      if (name == key) return value;
    }
    return "absent";
  }

  BusConfig bus_;
  std::vector<std::pair<std::string, std::uint8_t>> units_ = {{"gm1", 1}, {"gm2", 9}};
  std::unique_ptr<Simulator> simulator_;
};

TEST_F(MakeScSimulatorTest, WithoutKeysEveryUnitRuns) {
  ASSERT_EQ(Make("{}"), "");
  RunUntil(kStart + 60 * kSecond);
  for (const char* unit : {"gm1", "gm2"}) {
    EXPECT_EQ(Value(unit, "motor", kStart + 60 * kSecond), "running");
    EXPECT_EQ(Value(unit, "trip_count", kStart + 60 * kSecond), "0");
    EXPECT_EQ(Value(unit, "fault", kStart), "none");
    EXPECT_EQ(Value(unit, "mains_hz", kStart), "50");
    EXPECT_EQ(Value(unit, "version", kStart), "01 00");
  }
  EXPECT_EQ(Value("gm2", "address", kStart), "9");
}

TEST_F(MakeScSimulatorTest, EveryKeyIsTaken) {
  ASSERT_EQ(
      Make("timing: {reading: W, pace: wire, reply_delay_ms: 7.5, tolerance_ms: 0}\n"
           "gm1: {seed: 3, password: 'other-one', parameters: '52=800 54=5', dip_set: 2, mains_hz: 60,\n"
           "  version: '02 1f', product_code: XY, mfg_number: '12345', register_order: low_first,\n"
           "  character_order: low_first, out_of_range: keep, voltage_v: 220, power_factor: 0.7, speed_rpm: 60,\n"
           "  torque_nm: 20, run_up_w: 900, run_up_s: 1, ambient_c: 20, heating_c_per_w: 0.1, thermal_s: 100,\n"
           "  temperature_c: 33.5, accel_x_mps2: 1, accel_y_mps2: -2, accel_z_mps2: 9.81, vibration_mps2: 0.5,\n"
           "  shock: 'z:-40', fault: delayed, power: on}\n"
           "gm2: {load_w: 250}\n"),
      "");
  EXPECT_EQ(Value("gm1", "dip_set", kStart), "2");
  EXPECT_EQ(Value("gm1", "mains_hz", kStart), "60");
  EXPECT_EQ(Value("gm1", "version", kStart), "02 1F");
  EXPECT_EQ(Value("gm1", "temperature_c", kStart), "33.5");
  EXPECT_EQ(Value("gm1", "register_temperature", kStart), "335");
  EXPECT_EQ(Value("gm1", "fault", kStart), "delayed:5");
  EXPECT_THAT(Value("gm1", "parameters", kStart), testing::EndsWith(" 800 5000 5"));
  // 20 Nm x 2 pi x 60 rpm / 60 s / 0.8
  EXPECT_THAT(Value("gm1", "load_w", kStart), testing::StartsWith("157.07"));
  EXPECT_EQ(Value("gm2", "load_w", kStart), "250");
  EXPECT_EQ(Value("gm1", "password", kStart), "absent");
}

// The example of README.md.
TEST_F(MakeScSimulatorTest, AnOverloadInTheProfileTripsTheMotorAfterAWhile) {
  ASSERT_EQ(Make("gm1:\n"
                 "  load_profile: '0:150,20:150,25:500,30:150'\n"
                 "  script: [{at_s: 60, power: cycle}]\n"
                 "  script_period_s: 90\n"),
            "");
  // Beyond 400 W at 23.57 s, for a shock time of 1 s; powered on at 60 s, again at 83.57 s.
  for (const auto& [at_s, motor, trips] :
       std::vector<std::tuple<int, const char*, const char*>>{{24, "running", "0"},
                                                              {25, "tripped", "1"},
                                                              {59, "tripped", "1"},
                                                              {61, "running", "1"},
                                                              {85, "tripped", "2"}}) {
    const MonoNs at = kStart + at_s * kSecond;
    RunUntil(at);
    EXPECT_EQ(Value("gm1", "motor", at), motor) << at_s;
    EXPECT_EQ(Value("gm1", "trip_count", at), trips) << at_s;
  }
  EXPECT_EQ(Value("gm1", "trip_factor_1", kStart + 85 * kSecond), "power_upper_a");
}

TEST_F(MakeScSimulatorTest, AScriptTripsAndResets) {
  ASSERT_EQ(Make("gm1:\n"
                 "  load_w: 200\n"
                 "  script:\n"
                 "    - {at_s: 10, load_w: 450}\n"
                 "    - {at_s: 20, load_w: 200, reset_trip: now}\n"
                 "    - {at_s: 21, power: cycle}\n"
                 "    - {at_s: 30, trip: overheat}\n"
                 "  script_period_s: 40\n"),
            "");
  RunUntil(kStart + 12 * kSecond);
  EXPECT_EQ(Value("gm1", "motor_status", kStart + 12 * kSecond), "power_upper_a");
  EXPECT_EQ(Value("gm1", "register_power", kStart + 12 * kSecond), "0");
  RunUntil(kStart + 22 * kSecond);
  EXPECT_EQ(Value("gm1", "motor", kStart + 22 * kSecond), "running");
  EXPECT_EQ(Value("gm1", "trip_count", kStart + 22 * kSecond), "1");
  RunUntil(kStart + 31 * kSecond);
  EXPECT_EQ(Value("gm1", "motor", kStart + 31 * kSecond), "tripped");
  EXPECT_EQ(Value("gm1", "trip_factor_1", kStart + 31 * kSecond), "overheat");
  EXPECT_EQ(Value("gm1", "trip_factor_2", kStart + 31 * kSecond), "power_upper_a");
  EXPECT_EQ(Value("gm2", "trip_count", kStart + 31 * kSecond), "0");
}

TEST_F(MakeScSimulatorTest, WrongKeysAreNamed) {
  for (const auto& [yaml, text] : std::vector<std::pair<std::string, std::string>>{
           {"gm1: {load: 3}", "load"},
           {"timing: {reading: B}", "A, L, W, none"},
           {"timing: {reply_delay_ms: 1}", "5"},
           {"gm1: {mains_hz: 55}", "50, 60"},
           {"gm1: {dip_set: 5}", "1 to 4"},
           {"gm1: {parameters: '55=1'}", "54"},
           {"gm1: {parameters: '54=0'}", "address 54"},
           {"gm1: {parameters: '54'}", "ADDRESS=VALUE"},
           {"gm1: {version: '1'}", "two bytes in hex"},
           {"gm1: {version: '01 000'}", "two bytes in hex"},
           {"gm1: {product_code: TOOLONG}", "4 ASCII"},
           {"gm1: {shock: '5'}", "AXIS:MPS2"},
           {"gm1: {trip: fire}", "overheat"},
           {"gm1: {load_profile: '1:2'}", "begin with 0"},
           {"gm1: {script: [{at_s: 5, power: off}, {at_s: 6, trip: overheat}]}", "does not run"},
           {"gm1: {reset_trip: yes}", "now"}}) {
    EXPECT_THAT(Make(yaml), HasSubstr(text)) << yaml;
    EXPECT_EQ(simulator_, nullptr) << yaml;
  }
  EXPECT_THAT(Make("gm3: {load_w: 3}"), HasSubstr("gm3")) << "no unit of this bus";
  EXPECT_THAT(Make("gm1: {password: hunter2}"),
              testing::AllOf(HasSubstr("8 to 16"), testing::Not(HasSubstr("hunter"))));
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
