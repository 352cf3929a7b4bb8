#include "tools/fleet/channel_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tools/fleet/row_fixture.h"

namespace axlecast {
namespace {

using enum Detail;

LogFacts TwoLogs() {
  LogFacts facts = PressFacts();
  facts.prefix = "p3_";
  facts.logs = {LogNamed("around", "", "ALARM"), LogNamed("positions", "^p3_POSITION"), LogNamed("rest", "")};
  return facts;
}

Detail DetailIn(const std::string& log, const std::string& channel, const LogFacts& facts = TwoLogs()) {
  return ChannelChooser(facts, log, {}).Of(channel).detail.detail;
}

TEST(ChannelChoice, TheFirstLogWithoutATriggerThatMatches) {
  EXPECT_EQ(DetailIn("positions", "p3_POSITION/axis1"), kSamples);
  EXPECT_EQ(DetailIn("rest", "p3_POSITION/axis1"), kNone);
  EXPECT_EQ(DetailIn("around", "p3_POSITION/axis1"), kNone);
  EXPECT_EQ(DetailIn("rest", "p3_DEVICE/axis1"), kSamples);
  EXPECT_EQ(DetailIn("positions", "p3_DEVICE/axis1"), kNone);
  EXPECT_EQ(DetailIn("unknown", "p3_DEVICE/axis1"), kNone);
}

TEST(ChannelChoice, ChannelsOfTheMachineOnly) {
  EXPECT_EQ(DetailIn("rest", "DEVICE/axis1"), kNone);
  EXPECT_EQ(DetailIn("rest", "p3_WIRE/line1"), kNone);
  EXPECT_EQ(DetailIn("rest", "p3_LIMITS/motor1"), kNone);
  EXPECT_EQ(DetailIn("rest", "p3_COMMAND_STATUS"), kSamples);
  EXPECT_EQ(DetailIn("rest", "p3_COMMAND_STATUS/x"), kNone);
  EXPECT_EQ(DetailIn("rest", "p3_"), kNone);
}

TEST(ChannelChoice, KindsAndNames) {
  ChannelChooser chooser(TwoLogs(), "rest", {});
  EXPECT_EQ(chooser.Of("p3_ALARM/recorder/all").kind, ChannelKind::kAlarm);
  EXPECT_EQ(chooser.Of("p3_ALARM/recorder/all").name, "recorder/all");
  EXPECT_EQ(chooser.Of("p3_COMMAND").kind, ChannelKind::kCommand);
  EXPECT_EQ(chooser.Of("p3_TIME/host1").kind, ChannelKind::kTime);
}

TEST(ChannelChoice, TheFirstRuleThatMatches) {
  ChannelChooser chooser(
      TwoLogs(), "rest",
      Rules({{"^DEVICE/axis1$", {.detail = kNone}}, {"^(WIRE|DEVICE)/", {.detail = kFull, .raw = true}}}));
  EXPECT_EQ(chooser.Of("p3_DEVICE/axis1").detail.detail, kNone);
  EXPECT_EQ(chooser.Of("p3_DEVICE/axis2").detail.detail, kFull);
  const ChannelChoice wire = chooser.Of("p3_WIRE/line1");
  EXPECT_EQ(wire.detail.detail, kNone);  // there are no rows of it
  EXPECT_TRUE(wire.detail.raw);
  EXPECT_EQ(chooser.Of("p3_BUS/line1").detail.detail, kSamples);
}

TEST(ChannelChoice, RefusesAnExpressionThatIsInvalid) {
  DetailRules rules;
  EXPECT_FALSE(rules.Add("(", {}));
  EXPECT_FALSE(rules.Match("POSITION/axis1"));
}

// Which of POSITION and POSITION_BLOCK contributes rows, by their details.
std::string SourceWith(Detail position, Detail block) {
  LogFacts facts = PressFacts();
  facts.devices["axis1"].block = true;
  ChannelChooser chooser(facts, "all",
                         Rules({{"^POSITION/", {.detail = position}}, {"^POSITION_BLOCK/", {.detail = block}}}));
  std::string source;
  for (const std::string channel : {"POSITION/axis1", "POSITION_BLOCK/axis1"}) {
    if (chooser.Of(channel).detail.detail != kNone) source += channel + ' ';
  }
  return source;
}

TEST(ChannelChoice, OneSourceOfPositions) {
  EXPECT_EQ(SourceWith(kSamples, kSamples), "POSITION_BLOCK/axis1 ");
  EXPECT_EQ(SourceWith(kFull, kFull), "POSITION_BLOCK/axis1 ");
  EXPECT_EQ(SourceWith(kFull, kSamples), "POSITION/axis1 ");
  EXPECT_EQ(SourceWith(kSamples, kNone), "POSITION/axis1 ");
  EXPECT_EQ(SourceWith(kRollup, kSamples), "POSITION_BLOCK/axis1 ");
  EXPECT_EQ(SourceWith(kNone, kNone), "");
}

TEST(ChannelChoice, WithoutBlocksInTheFilePositionIsTheSource) {
  EXPECT_EQ(DetailIn("all", "POSITION/axis1", PressFacts()), kSamples);
  EXPECT_EQ(DetailIn("all", "POSITION_BLOCK/axis1", PressFacts()), kNone);
  EXPECT_EQ(DetailIn("all", "POSITION/unknown", PressFacts()), kSamples);
  // Blocks that no log of the machine holds.
  LogFacts facts = PressFacts();
  facts.devices["axis1"].block = true;
  facts.logs[0].channels = "^POSITION/";
  EXPECT_EQ(DetailIn("all", "POSITION/axis1", facts), kSamples);
}

TEST(LogFactsOf, AxesWithTheirScale) {
  Family encoder;
  Family monitor;
  monitor.has_position = false;
  auto settings = std::make_shared<DeviceSettings>();
  settings->counts_per_turn = 131'072;
  DeviceConfig axis;
  axis.name = "axis1";
  axis.unit = position_t::UNIT_MM;
  axis.per_turn = 5;
  axis.ratio_num = 3;
  axis.ratio_den = 2;
  axis.modulo = 360;
  axis.block = true;
  axis.settings = settings;
  DeviceConfig motor;
  motor.name = "motor1";
  motor.settings = settings;
  MachineConfig machine;
  machine.machine = "press3";
  machine.lcm.prefix = "p3_";
  machine.recorder.logs = {LogNamed("all", "")};
  machine.buses.resize(2);
  machine.buses[0].family = &encoder;
  machine.buses[0].devices = {axis};
  machine.buses[1].family = &monitor;
  machine.buses[1].devices = {motor};

  const LogFacts facts = LogFactsOf(machine);
  EXPECT_EQ(facts.machine, "press3");
  EXPECT_EQ(facts.prefix, "p3_");
  ASSERT_EQ(facts.logs.size(), 1U);
  ASSERT_EQ(facts.devices.size(), 1U);
  const LogFacts::Device& device = facts.devices.at("axis1");
  EXPECT_EQ(device.counts_per_turn, 131'072);
  EXPECT_EQ(device.unit, position_t::UNIT_MM);
  EXPECT_DOUBLE_EQ(device.unit_per_count, 7.5 / 131'072);
  EXPECT_TRUE(device.block);
}

}  // namespace
}  // namespace axlecast
