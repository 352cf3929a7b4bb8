#include "core/config/load.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/position_t.hpp>
#include <cstdlib>
#include <numbers>

#include "core/config/test_family.h"

namespace axlecast {
namespace {

using test_family::Machine;
using ::testing::HasSubstr;

std::optional<MachineConfig> Parse(const std::string& text, std::string* errors_text = nullptr) {
  ConfigErrors errors("m.yaml");
  auto machine = ParseConfig(text, errors);
  if (errors_text != nullptr) {
    *errors_text = errors.Text();
  } else {
    EXPECT_EQ(errors.Text(), "");
  }
  EXPECT_EQ(machine.has_value(), errors.empty());
  return machine;
}

std::string ErrorsOf(const std::string& text) {
  std::string errors;
  Parse(text, &errors);
  return errors;
}

DeviceConfig Device(const std::string& keys) {
  const auto machine = Parse(Machine("simulate: true", keys));
  return machine ? machine->buses.at(0).devices.at(0) : DeviceConfig{};
}

TEST(LoadConfig, ReadsAWholeMachine) {
  const auto machine = Parse(R"(
machine: press3
lcm: {url: "udpm://239.1.2.3:7777?ttl=1", command_url: "udpm://239.1.2.3:7778?ttl=1", prefix: "cell1/"}
bridge: {unsigned_commands: allow}
buses:
  rs485-0:
    family: point
    link: {port: /dev/ttyUSB0, baud: 1250000, echo: true}
    simulate: false
    capture: true
    poll_hz: 2000
    phase_us: 125.5
    realtime: {priority: 50, cpu: 1, lock_memory: true}
    devices:
      axis1: {model: mt17, direction: cw, unit: mm, per_turn: 5.0, ratio: "1:10", modulo: 100, publish_hz: 500,
              block: true, limits: {speed_rpm: 3000, accel_rad_s2: 500}, turns: signed, datum: {counts: -12345},
              permit: not_required, tag: "A1 05"}
)");
  ASSERT_TRUE(machine);
  EXPECT_EQ(machine->machine, "press3");
  EXPECT_EQ(machine->lcm.url, "udpm://239.1.2.3:7777?ttl=1");
  EXPECT_EQ(machine->lcm.command_url, "udpm://239.1.2.3:7778?ttl=1");
  EXPECT_EQ(machine->lcm.prefix, "cell1/");
  EXPECT_TRUE(machine->bridge.allow_unsigned);
  const BusConfig* bus = machine->FindBus("rs485-0");
  ASSERT_NE(bus, nullptr);
  EXPECT_EQ(bus->family->name, "point");
  EXPECT_EQ(bus->link.port, "/dev/ttyUSB0");
  EXPECT_EQ(bus->link.line.baud, 1'250'000);
  EXPECT_TRUE(bus->link.echo);
  EXPECT_FALSE(bus->simulate);
  EXPECT_TRUE(bus->capture);
  EXPECT_DOUBLE_EQ(bus->poll_hz, 2000);
  EXPECT_EQ(bus->phase, 125'500);
  EXPECT_EQ(bus->realtime.priority, 50);
  EXPECT_EQ(bus->realtime.cpu, 1);
  EXPECT_TRUE(bus->realtime.lock_memory);
  EXPECT_EQ(RoundTime(*bus), 102 * kMicrosecond) << "at half the usual rate";
  EXPECT_EQ(machine->BusOf("axis1"), bus);
  EXPECT_EQ(machine->BusOf("axis2"), nullptr);
  const DeviceConfig& device = bus->devices.at(0);
  EXPECT_EQ(device.name, "axis1");
  EXPECT_EQ(device.line, 15);
  EXPECT_EQ(device.model, "mt17");
  EXPECT_EQ(device.direction, -1);
  EXPECT_EQ(device.unit, position_t::UNIT_MM);
  EXPECT_DOUBLE_EQ(device.per_turn, 5);
  EXPECT_EQ(device.ratio_num, 1);
  EXPECT_EQ(device.ratio_den, 10);
  EXPECT_DOUBLE_EQ(device.modulo, 100);
  EXPECT_DOUBLE_EQ(device.publish_hz, 500);
  EXPECT_TRUE(device.block);
  EXPECT_DOUBLE_EQ(device.speed_rpm, 3000);
  EXPECT_DOUBLE_EQ(device.accel_rad_s2, 500);
  EXPECT_EQ(device.turns, TurnsMode::kSigned);
  EXPECT_EQ(device.datum_counts, -12345);
  EXPECT_FALSE(device.permit_required);
}

TEST(LoadConfig, WhatIsLeftOutHasTheDocumentedDefault) {
  const auto machine = Parse(Machine("link: {port: /dev/ttyS0}", ""));
  ASSERT_TRUE(machine);
  EXPECT_EQ(machine->lcm.url, "udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(machine->lcm.command_url, "udpm://239.255.76.67:7668?ttl=0");
  EXPECT_FALSE(machine->bridge.allow_unsigned);
  const BusConfig& bus = machine->buses.at(0);
  EXPECT_EQ(bus.link.line.baud, 2'500'000) << "the family's";
  EXPECT_FALSE(bus.link.echo);
  EXPECT_DOUBLE_EQ(bus.poll_hz, 1000);
  EXPECT_EQ(bus.realtime.priority, 0);
  EXPECT_EQ(bus.realtime.cpu, -1);
  const DeviceConfig& device = bus.devices.at(0);
  EXPECT_EQ(device.direction, 1);
  EXPECT_EQ(device.unit, position_t::UNIT_TURN);
  EXPECT_DOUBLE_EQ(device.per_turn, 1);
  EXPECT_EQ(device.turns, TurnsMode::kModulo);
  EXPECT_FALSE(device.datum_counts);
  EXPECT_DOUBLE_EQ(device.publish_hz, 1000);
  EXPECT_DOUBLE_EQ(device.speed_rpm, 0);
  EXPECT_TRUE(device.permit_required);
}

TEST(LoadConfig, EveryUnitKnowsItsTurn) {
  EXPECT_DOUBLE_EQ(Device("unit: turn").per_turn, 1);
  EXPECT_DOUBLE_EQ(Device("unit: rad").per_turn, 2 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(Device("unit: deg").per_turn, 360);
  EXPECT_DOUBLE_EQ(Device("unit: count").per_turn, 131'072);
  for (const char* unit : {"mm", "m", "um", "inch"}) {
    EXPECT_DOUBLE_EQ(Device(std::string("unit: ") + unit + ", per_turn: 2.5").per_turn, 2.5);
  }
}

TEST(LoadConfig, TheDefaultOfPublishingIsNeverAboveThePoll) {
  const auto slow = Parse(Machine("simulate: true\n    poll_hz: 250", ""));
  ASSERT_TRUE(slow);
  EXPECT_DOUBLE_EQ(slow->buses[0].devices[0].publish_hz, 250);
  const auto free = Parse(Machine("simulate: true\n    poll_hz: 0", "publish_hz: 5000"));
  ASSERT_TRUE(free);
  EXPECT_DOUBLE_EQ(free->buses[0].devices[0].publish_hz, 5000);
}

TEST(LoadConfig, ASimulatedBusNeverUsesTheRealPort) {
  setenv("AXLECAST_RUN_DIR", "/run/axlecast", 1);
  const auto machine = Parse(Machine("simulate: true\n    link: {port: /dev/ttyUSB0}", ""));
  unsetenv("AXLECAST_RUN_DIR");
  ASSERT_TRUE(machine);
  EXPECT_EQ(machine->buses[0].link.port, "/run/axlecast/press3/b0.pty");
}

TEST(LoadConfig, RunDirectoryFollowsTheEnvironment) {
  unsetenv("AXLECAST_RUN_DIR");
  setenv("XDG_RUNTIME_DIR", "/run/user/1000", 1);
  EXPECT_EQ(RunDirectory("press3"), "/run/user/1000/axlecast/press3");
  unsetenv("XDG_RUNTIME_DIR");
  EXPECT_THAT(RunDirectory("press3"), ::testing::MatchesRegex("/tmp/axlecast-[0-9]+/press3"));
}

TEST(LoadConfig, TheHashFollowsTheDevicesKeysAndNothingElse) {
  const std::int64_t hash = Device("unit: deg, turns: signed").config_hash;
  EXPECT_EQ(Device("turns: signed, unit: 'deg'").config_hash, hash);
  EXPECT_NE(Device("unit: rad, turns: signed").config_hash, hash);
  EXPECT_NE(Device("unit: deg").config_hash, hash);
  // FNV-1a of the two characters {} by an independent program.
  EXPECT_EQ(Device("").config_hash, 0x08F44B07B5901A25);
}

TEST(LoadConfig, TellsAllErrorsInOneGo) {
  EXPECT_EQ(
      ErrorsOf(Machine("poll: 1", "unit: mn, direction: up")),
      "m.yaml:3:3: buses.b0.link.port: is missing: name the serial port, best by its lasting name (ls -l "
      "/dev/serial/by-id/), or set simulate: true\n"
      "m.yaml:5:5: buses.b0: unknown key 'poll'; did you mean 'poll_hz'?\n"
      "m.yaml:6:29: buses.b0.devices.axis1.unit: 'mn' is not one of count, turn, rad, deg, mm, m, um, inch; did "
      "you mean 'mm'?\n"
      "m.yaml:6:44: buses.b0.devices.axis1.direction: 'up' is not one of ccw, cw\n");
}

TEST(LoadConfig, ADriverLeavesOtherFamiliesToOthers) {
  const std::string text =
      "machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {a: {}}}\n"
      "  b1: {family: of_another_driver, magic: 1, devices: {b: {}}}\n";
  ConfigErrors errors("m.yaml");
  const auto machine = ParseConfig(text, errors, "b0");
  EXPECT_EQ(errors.Text(), "");
  ASSERT_TRUE(machine);
  ASSERT_EQ(machine->buses.size(), 1U);
  EXPECT_EQ(machine->buses[0].name, "b0");
  ConfigErrors missing("m.yaml");
  EXPECT_FALSE(ParseConfig(text, missing, "b2"));
  EXPECT_THAT(missing.Text(), HasSubstr("m.yaml:3:3: buses: there is no bus 'b2'"));
}

TEST(LoadConfig, AFileThatCannotBeReadSaysWhy) {
  ConfigErrors errors("/nowhere/m.yaml");
  EXPECT_FALSE(LoadConfig("/nowhere/m.yaml", errors));
  EXPECT_EQ(errors.Text(), "/nowhere/m.yaml: cannot be read: No such file or directory\n");
  ConfigErrors directory("/tmp");
  EXPECT_FALSE(LoadConfig("/tmp", directory));
  EXPECT_THAT(directory.Text(), HasSubstr("/tmp: cannot be read: it is a directory"));
}

TEST(MakeSimulator, ReadsTheKeysWhereTheyStandInTheFile) {
  const auto machine = Parse(Machine("simulate: {speed_rpm: 600}", ""));
  ASSERT_TRUE(machine);
  EXPECT_TRUE(machine->buses[0].simulate);
  ConfigErrors errors("m.yaml");
  EXPECT_NE(MakeSimulator(*machine, machine->buses[0], errors), nullptr);
  EXPECT_EQ(errors.Text(), "");

  const auto plain = Parse(Machine("simulate: true", ""));
  ASSERT_TRUE(plain);
  EXPECT_NE(MakeSimulator(*plain, plain->buses[0], errors), nullptr);

  const auto wrong = Parse(Machine("simulate: {speed_rpm: fast, sped_rpm: 1}", ""));
  ASSERT_TRUE(wrong);
  EXPECT_EQ(MakeSimulator(*wrong, wrong->buses[0], errors), nullptr);
  EXPECT_EQ(errors.Text(),
            "m.yaml:5:27: buses.b0.simulate.speed_rpm: 'fast' is not a number (-6000 to 6000 rpm)\n"
            "m.yaml:5:33: buses.b0.simulate: unknown key 'sped_rpm'; did you mean 'speed_rpm'?\n");
}

}  // namespace

std::span<const Family* const> Families() { return test_family::Table(); }

}  // namespace axlecast
