#include "core/config/sets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/hosts.h"
#include "core/config/load.h"
#include "core/config/test_family.h"
#include "core/config/ticks.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

const std::string kHead =
    "machine: press\n"
    "lcm: {url: 'udpm://239.255.76.67:7667?ttl=1', command_url: 'udpm://239.255.76.67:7668?ttl=1'}\n";

std::string Bus(const std::string& name, const std::string& keys, const std::string& device = "{}") {
  return "  " + name + ": {family: point, link: {port: /dev/tty" + name + "}, " + keys + ", devices: {axis_" +
         name + ": " + device + "}}\n";
}

const std::string kBuses = "buses:\n" + Bus("x", "poll_hz: 1000") + Bus("y", "poll_hz: 1000") +
                           Bus("slow", "poll_hz: 100") + Bus("decimated", "poll_hz: 1000", "{publish_hz: 100}") +
                           Bus("odd", "poll_hz: 1000", "{publish_hz: 300}") + Bus("fast", "poll_hz: 0") +
                           Bus("late", "poll_hz: 1000, phase_us: 100");

std::string ErrorsOf(const std::string& set, const std::string& more = "") {
  ConfigErrors errors("m.yaml");
  static_cast<void>(ParseConfig(kHead + kBuses + more + "sets: {gantry: " + set + "}\n", errors));
  return errors.Text();
}

MachineConfig Press(const std::string& more) {
  ConfigErrors errors("m.yaml");
  auto machine = ParseConfig(kHead + kBuses + more, errors);
  EXPECT_TRUE(machine) << errors.Text();
  return machine.value_or(MachineConfig{});
}

TEST(Sets, AreAxesWithTheSameTicks) {
  const MachineConfig machine = Press("sets: {gantry: {axes: [axis_x, axis_y], limit_us: 300}}\n");
  ASSERT_EQ(machine.sets.size(), 1U);
  EXPECT_EQ(machine.sets[0].name, "gantry");
  EXPECT_EQ(machine.sets[0].axes, (std::vector<std::string>{"axis_x", "axis_y"}));
  EXPECT_EQ(machine.sets[0].limit, 300 * kMicrosecond);
  EXPECT_EQ(machine.sets[0].period, kMillisecond);
}

TEST(Sets, MayHaveAxesThatAreReadMoreOftenThanPublished) {
  const MachineConfig machine = Press("sets: {gantry: {axes: [axis_slow, axis_decimated], limit_us: 300}}\n");
  ASSERT_EQ(machine.sets.size(), 1U);
  EXPECT_EQ(machine.sets[0].period, 10 * kMillisecond);
  const BusConfig& bus = *machine.FindBus("decimated");
  EXPECT_EQ(TicksPerMessage(bus, bus.devices[0]), 10);
}

TEST(Sets, AreRefusedWithTheReasonAndWhatToChange) {
  EXPECT_THAT(ErrorsOf("{axes: [axis_x, axis_z], limit_us: 1}"), HasSubstr("there is no device 'axis_z'"));
  EXPECT_THAT(ErrorsOf("{axes: [axis_x, axis_y]}"), HasSubstr("limit_us"));
  EXPECT_THAT(ErrorsOf("{axes: [axis_x, axis_y], limit_us: 0}"), HasSubstr("limit_us"));
  EXPECT_THAT(ErrorsOf("{axes: [axis_x, axis_slow], limit_us: 1}"), HasSubstr("give both the same publish_hz"));
  EXPECT_THAT(ErrorsOf("{axes: [axis_x, axis_odd], limit_us: 1}"), HasSubstr("whole multiple of publish_hz"));
  EXPECT_THAT(ErrorsOf("{axes: [axis_x, axis_fast], limit_us: 1}"), HasSubstr("set poll_hz of bus fast"));
  EXPECT_THAT(ErrorsOf("{axes: [axis_x, axis_late], limit_us: 1}"), HasSubstr("different phase_us"));
  EXPECT_THAT(ErrorsOf("{limit_us: 1}"), HasSubstr("axes"));
}

const std::string kHosts =
    "hosts:\n  plc1: {bridge: true, buses: [x, slow, decimated, odd, fast, late]}\n  cell2: {buses: [y]}\n";

TEST(Sets, NeedATimeBaseOnSeveralHosts) {
  EXPECT_THAT(ErrorsOf("{axes: [axis_x, axis_y], limit_us: 1}", kHosts), HasSubstr("add `time:"));
  EXPECT_EQ(ErrorsOf("{axes: [axis_x, axis_decimated], limit_us: 1}", kHosts).find("add `time:"),
            std::string::npos);
  EXPECT_EQ(
      ErrorsOf("{axes: [axis_x, axis_y], limit_us: 1}", kHosts + "time: {root: plc1, address: 192.168.5.1}\n"), "");
}

TEST(Sets, ArePublishedByTheHostOfTheBridgeOrByTheNamedOne) {
  const std::string set =
      "time: {root: plc1, address: 192.168.5.1}\nsets: {gantry: {axes: [axis_x, axis_y], limit_us: 1}}\n";
  const MachineConfig machine = Press(kHosts + set);
  EXPECT_EQ(PartOn(machine, "plc1")->sets.size(), 1U);
  EXPECT_TRUE(PartOn(machine, "cell2")->sets.empty());
  const MachineConfig named = Press(
      "hosts:\n  plc1: {bridge: true, buses: [x, slow, decimated, odd, fast, late]}\n  cell2: {buses: [y], sets: "
      "true}\n" +
      set);
  EXPECT_TRUE(PartOn(named, "plc1")->sets.empty());
  EXPECT_EQ(PartOn(named, "cell2")->sets.size(), 1U);
}

TEST(Sets, OneBusOfTheFileLoadsWithoutThem) {
  ConfigErrors errors("m.yaml");
  const auto machine =
      ParseConfig(kHead + kBuses + "sets: {gantry: {axes: [axis_x, axis_y], limit_us: 300}}\n", errors, "x");
  ASSERT_TRUE(machine) << errors.Text();
  EXPECT_TRUE(machine->sets.empty());
}

}  // namespace
}  // namespace axlecast
