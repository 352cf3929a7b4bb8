#include "drivers/tsubaki_sc/settings.h"

#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include "core/config/load.h"
#include "core/config/machine_config.h"

namespace axlecast::tsubaki_sc {
namespace {

using testing::HasSubstr;

struct Loaded {
  std::optional<MachineConfig> machine;
  std::string problems;
};
// A machine with one bus: line 4 holds its keys, line 6 and on its devices.
Loaded Load(const std::string& bus_keys, const std::vector<std::string>& devices) {
  std::string text = "machine: m\nbuses:\n  motors:\n    " + bus_keys + (bus_keys.empty() ? "" : "\n    ") +
                     "family: tsubaki_sc\n    link: {port: /dev/ttyS0}\n    devices:\n";
  for (std::size_t i = 0; i < devices.size(); ++i) {
    text += "      gm" + std::to_string(i + 1) + ": {" + devices[i] + "}\n";
  }
  ConfigErrors errors("m.yaml");
  Loaded loaded{.machine = ParseConfig(text, errors), .problems = {}};
  loaded.problems = errors.Text();
  return loaded;
}
const ScSettings& Unit(const Loaded& loaded, std::size_t index = 0) {
  return static_cast<const ScSettings&>(*loaded.machine->buses[0].devices[index].settings);
}

TEST(Settings, HaveSafeDefaults) {
  const Loaded loaded = Load("", {"address: 16"});
  ASSERT_TRUE(loaded.machine) << loaded.problems;
  const ScSettings& unit = Unit(loaded);
  EXPECT_EQ(unit.address, 16);
  EXPECT_EQ(unit.motor_control, MotorControl::kNone);
  EXPECT_EQ(unit.trip_fetch, TripFetchMode::kSuspendLive);
  EXPECT_EQ(unit.password_format.order, CharacterOrder::kHighFirst);
  EXPECT_EQ(unit.password_format.padding, 0x00);
  EXPECT_FALSE(unit.holds_secrets);
  const BusConfig& bus = loaded.machine->buses[0];
  EXPECT_EQ(bus.link.line.baud, 9'600);
  EXPECT_EQ(bus.link.line.parity, Parity::kEven);
  EXPECT_EQ(bus.family_bus->pacing, Pacing{.after_reply = 100 * kMillisecond});
}

TEST(Settings, NamePasswordsByTheirPlace) {
  const Loaded loaded = Load("", {"address: 1, motor_control: start_stop, password: b, endian: low, "
                                  "password_padding: space, trip_fetch: alternate, timeout_us: 200000, "
                                  "passwords: {a: {file: /etc/a}, b: {credential: sc-b}}"});
  ASSERT_TRUE(loaded.machine) << loaded.problems;
  const ScSettings& unit = Unit(loaded);
  EXPECT_TRUE(unit.holds_secrets);
  EXPECT_EQ(unit.password, "b");
  EXPECT_EQ(unit.passwords.at("a").file, "/etc/a");
  EXPECT_EQ(unit.passwords.at("b").credential, "sc-b");
  EXPECT_EQ(unit.motor_control, MotorControl::kStartStop);
  EXPECT_EQ(unit.password_format.order, CharacterOrder::kLowFirst);
  EXPECT_EQ(unit.password_format.padding, 0x20);
  EXPECT_EQ(unit.trip_fetch, TripFetchMode::kAlternate);
  EXPECT_EQ(unit.timeout, 200 * kMillisecond);
}

// Device facts: 267 ms of a unit's live data at reading A, 218 ms at L; 16 units 4.28 s and 3.49 s.
TEST(Settings, ALiveCycleTakesWhatTheReadingOfThePauseMakesOfIt) {
  const auto milliseconds = [](PacingReading reading, std::size_t units) {
    return static_cast<double>(LiveCycle(reading, units)) / kMillisecond;
  };
  EXPECT_NEAR(milliseconds(PacingReading::kAfterReply, 16), 267.3, 0.1);
  EXPECT_NEAR(16 * milliseconds(PacingReading::kAfterReply, 16), 4'280, 5);
  EXPECT_NEAR(milliseconds(PacingReading::kAfterRequest, 16), 218.3, 0.1);
  EXPECT_NEAR(16 * milliseconds(PacingReading::kAfterRequest, 16), 3'490, 5);
  EXPECT_NEAR(milliseconds(PacingReading::kPerUnit, 1), 267.3, 0.1);
  EXPECT_NEAR(milliseconds(PacingReading::kPerUnit, 16), 77.3, 0.1)
      << "the pauses of one hold the others' requests";
  const Loaded loaded = Load("pacing: after_request", {"address: 1", "address: 2"});
  ASSERT_TRUE(loaded.machine) << loaded.problems;
  EXPECT_EQ(Unit(loaded).wire_time, LiveCycle(PacingReading::kAfterRequest, 2));
  EXPECT_EQ(Unit(loaded).exchanges, 2);
  EXPECT_EQ(loaded.machine->buses[0].family_bus->pacing,
            (Pacing{.after_request = 100 * kMillisecond, .after_reply = 5 * kMillisecond}));
}

TEST(Settings, AMistakeIsRefusedWithItsLineAndWhatWouldBeRight) {
  const struct {
    const char* device;
    const char* problem;
  } kCases[] = {
      {"motor_control: none", "gm1.address: is missing: 1 to 16"},
      {"address: 0", "1"},
      {"address: 17", "16"},
      {"address: 1, motor_control: yes", "start_stop"},
      {"address: 1, motor_control: stop", "needs passwords and password"},
      {"address: 1, passwords: {a: {file: /a}}", "is missing: name the one of passwords"},
      {"address: 1, password: letmein99", "it is the NAME of one of them, never the password"},
      {"address: 1, password: a, passwords: {a: {}}", "exactly one of file"},
      {"address: 1, password: a, passwords: {a: {file: /a, credential: a}}",
       "credential: is given together with file"},
      {"address: 1, password: a, passwords: {a: {file: a}}", "no absolute path"},
      {"address: 1, password: a, passwords: {a: {credential: ../a}}", "without '/'"},
      {"address: 1, password: A, passwords: {A: {file: /a}}", "is no name"},
      {"address: 1, password: a, passwords: {a: {fil: /a}}", "file"},
      {"address: 1, timeout_us: 1000", "61,000 on the wire"},
      {"address: 1, trip_fetch: never", "alternate"},
      {"address: 1, endian: middle", "high"},
      {"address: 1, adress: 2", "address"},
  };
  for (const auto& c : kCases) {
    const Loaded loaded = Load("", {c.device});
    EXPECT_FALSE(loaded.machine) << c.device;
    EXPECT_THAT(loaded.problems, HasSubstr(c.problem)) << c.device;
    EXPECT_THAT(loaded.problems, HasSubstr("m.yaml:7:")) << c.device;
  }
}

TEST(Settings, TwoUnitsWithOneAddressAreRefused) {
  const Loaded loaded = Load("", {"address: 3", "address: 3"});
  EXPECT_FALSE(loaded.machine);
  EXPECT_THAT(loaded.problems, HasSubstr("3 is gm1's already"));
  EXPECT_THAT(loaded.problems, HasSubstr("m.yaml:8:"));
}

// Guideline 2: 9600 8E1 is fixed.
TEST(Settings, AnotherLineIsRefused) {
  const struct {
    const char* link;
    const char* problem;
  } kCases[] = {
      {"baud: 19200", "9600"}, {"parity: odd", "even"}, {"parity: none", "even"}, {"stop_bits: 2", "has 1"}};
  for (const auto& c : kCases) {
    ConfigErrors errors("m.yaml");
    const std::string text = std::string(
                                 "machine: m\nbuses:\n  motors:\n    family: tsubaki_sc\n"
                                 "    link: {port: /dev/ttyS0, ") +
                             c.link + "}\n    devices:\n      gm1: {address: 1}\n";
    EXPECT_FALSE(ParseConfig(text, errors)) << c.link;
    EXPECT_THAT(errors.Text(), HasSubstr(c.problem));
    EXPECT_THAT(errors.Text(), HasSubstr("m.yaml:5:"));
  }
}

TEST(Settings, AnUnknownReadingIsRefused) {
  EXPECT_THAT(Load("pacing: A", {"address: 1"}).problems, HasSubstr("after_reply"));
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
