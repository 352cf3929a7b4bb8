// The dialogue on 7E5 that every node on the bus takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>

#include "drivers/saa_can/bus_test_support.h"
#include "drivers/saa_can/node_configuration.h"

namespace axlecast::saa_can {
namespace {

using testing::HasSubstr;
using Reason = command_status_t;

constexpr const char* kBench = "simulate: true, bench: true, poll_hz: 50, ";
const Arguments kNode = {{"node", "0x33"}, {"confirm", "only_one_connected"}};
const Arguments kBitrate = {{"bitrate", "500000"}, {"confirm", "only_one_connected"}};

int Asked(const SimulatedBus& bus) { return bus.frames->Sent(0x7E5, 0x04) + bus.frames->Sent(0x7E5, 0x11); }

TEST(SaaCanDialogue, IsOfABenchAndConfirmed) {
  SimulatedBus bus("a: {bits: 14}");
  bus.Run(kSecond);
  EXPECT_THAT(bus.Do("set_node_id", kNode).text, HasSubstr("bench: true"));
  SimulatedBus bench("a: {bits: 14}", "", kBench);
  bench.Run(kSecond);
  EXPECT_THAT(bench.Do("set_node_id", {{"node", "0x33"}}).text, HasSubstr("confirm=only_one_connected"));
  EXPECT_THAT(bench.Do("set_node_id", {{"node", "0x33"}, {"confirm", "yes"}}).text, HasSubstr("confirm="));
  EXPECT_EQ(Asked(bus) + Asked(bench), 0);
}

class SaaCanNode : public testing::TestWithParam<std::tuple<const char*, const char*>> {};

TEST_P(SaaCanNode, ItAnswersAsTheNewNode) {
  const auto [mode, replies_on] = GetParam();
  SimulatedBus bus(std::string("a: {bits: 14, mode: ") + mode + "}",
                   std::string("a: {start_deg: 10, replies_on: ") + replies_on + "}", kBench);
  bus.Run(kSecond);
  const MonoNs began = bus.clock.Now();
  const Outcome outcome = bus.Do("set_node_id", kNode);
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_TRUE(outcome.verified);
  EXPECT_THAT(outcome.text, HasSubstr("put node: 0x33 into the file"));
  EXPECT_GT(bus.clock.Now() - began, NodeConfigurationProcedure::kListen);
  EXPECT_EQ(bus.State("a", "node"), "51");
  EXPECT_EQ(bus.State("a", "mode"), "waiting") << "it left configuration mode";
  EXPECT_EQ(bus.frames->Sent(0x7E5, 0x11), 1);
  EXPECT_EQ(bus.output().nv_writes, 1);
}

INSTANTIATE_TEST_SUITE_P(Mode, SaaCanNode,
                         testing::Combine(testing::Values("cyclic", "single"), testing::Values("7e5", "7e4")));

TEST(SaaCanDialogue, ANodeIdThatHoldsFromTheNextPowerOnIsNotVerified) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 10, changes: at_power_on}", kBench);
  bus.Run(kSecond);
  const Outcome outcome = bus.Do("set_node_id", kNode);
  EXPECT_EQ(outcome.state, CommandState::kSucceeded);
  EXPECT_FALSE(outcome.verified);
  EXPECT_THAT(outcome.text, HasSubstr("turn its power off and on"));
  EXPECT_EQ(After(bus.Do("read_position", {{"after", "set_node_id node=0x33"}}), "finding"), "no_effect_seen");
  bus.Set("a", "power", "off");
  bus.Run(kSecond);
  bus.Set("a", "power", "on");
  bus.Run(kSecond);
  EXPECT_EQ(After(bus.Do("read_position", {{"after", "set_node_id node=0x33"}}), "finding"), "reads_as_after");
}

// A frame of any other node comes, before the dialogue or within it.
TEST(SaaCanDialogue, AnybodyElseOnTheBusStopsIt) {
  for (const std::uint32_t id : {0x121U, 0x220U, 0x701U, 0x18FF1234U | kCanExtended, 0x7E5U}) {
    SimulatedBus bus("a: {bits: 14}", "", kBench);
    bus.Run(kSecond);
    bus.Begin("set_node_id", kNode);
    bus.Run(2 * kSecond);
    bus.frames->Inject({.id = id, .data = {0x80, 0x20, 0, 0, 0, 0, 0, 0}});
    const Outcome outcome = bus.Finish();
    EXPECT_EQ(outcome.state, CommandState::kRejected) << id;
    EXPECT_EQ(Asked(bus), 0) << id;
  }
}

TEST(SaaCanDialogue, SomebodyWhoAppearsInConfigurationModeStopsItBeforeTheChange) {
  SimulatedBus bus("a: {bits: 14}", "", kBench);
  bus.Run(kSecond);
  bus.Begin("set_node_id", kNode);
  while (bus.frames->Sent(0x7E5, 0x04) == 0) bus.Run(kMillisecond);
  bus.frames->Inject({.id = 0x121, .data = {0x00, 0x10}});
  const Outcome outcome = bus.Finish();
  EXPECT_EQ(outcome.state, CommandState::kRejected);
  EXPECT_EQ(bus.frames->Sent(0x7E5, 0x11), 0);
  EXPECT_EQ(bus.State("a", "mode"), "waiting");
}

TEST(SaaCanDialogue, TheEncoderItselfMustBeHeard) {
  SimulatedBus bus("a: {bits: 14}", "", kBench);
  bus.Run(kSecond);
  bus.Begin("set_node_id", kNode);
  bus.Set("a", "fault", "off");
  bus.Run(kMillisecond);
  const Outcome outcome = bus.Finish();
  EXPECT_EQ(outcome.state, CommandState::kRejected);
  EXPECT_EQ(Asked(bus), 0);
}

// A node that kept silent while it was listened for answers the dialogue.
TEST(SaaCanDialogue, TwoRepliesShowThatOneHadKeptSilent) {
  SimulatedBus bus("a: {bits: 14}", "", kBench);
  bus.Run(kSecond);
  bus.Begin("set_node_id", kNode);
  while (bus.frames->Sent(0x7E5, 0x11) == 0) bus.Run(kMillisecond);
  bus.Run(2 * kMillisecond);
  bus.frames->Inject({.id = 0x7E5, .data = {0x11, 0, 0, 0, 0, 0, 0, 0}});
  const Outcome outcome = bus.Finish();
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_THAT(outcome.text, HasSubstr("2 nodes answered"));
}

TEST(SaaCanDialogue, ABitRateIsAcceptedAndThenNothingIsSent) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 10}", kBench);
  bus.Run(kSecond);
  const Outcome outcome = bus.Do("set_bitrate", kBitrate);
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_FALSE(outcome.verified);
  EXPECT_EQ(
      outcome.text,
      "accepted; as root: ip link set can-0 down; ip link set can-0 up type can bitrate 500000 restart-ms 100; "
      "set link.bitrate: 500000, power-cycle the encoder, restart the driver");
  EXPECT_LE(outcome.text.size(), 180U) << "200 bytes fit, and interfaces have up to 15";
  EXPECT_EQ(bus.State("a", "bitrate"), "500000");
  const std::size_t sent = bus.frames->sent().size();
  bus.Run(10 * kSecond);
  EXPECT_EQ(bus.frames->sent().size(), sent) << "the interface still has the old rate";
  EXPECT_EQ(bus.Do("zero").reason, Reason::REASON_DEVICE_OFFLINE);
}

TEST(SaaCanDialogue, NoReplyToABitRateIsInDoubt) {
  SimulatedBus bus("a: {bits: 14}", "", kBench);
  bus.Run(kSecond);
  bus.Begin("set_bitrate", kBitrate);
  while (bus.frames->Sent(0x7E5, 0x04) == 0) bus.Run(kMillisecond);
  bus.Set("a", "fault", "off");
  EXPECT_EQ(bus.Finish().state, CommandState::kIndeterminate);
}

TEST(SaaCanDialogue, ARefusalIsTold) {
  SimulatedBus bus("a: {bits: 14}", "", kBench);
  bus.Run(kSecond);
  bus.Begin("set_node_id", kNode);
  while (bus.frames->Sent(0x7E5, 0x11) == 0) bus.Run(20 * kMicrosecond);
  bus.frames->Inject({.id = 0x7E4, .data = {0x11, 0x01, 0, 0, 0, 0, 0, 0}});
  const Outcome outcome = bus.Finish();
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(outcome.reason, Reason::REASON_DEVICE_REFUSED);
}

}  // namespace
}  // namespace axlecast::saa_can
