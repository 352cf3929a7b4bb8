// set_address, query_address and read_position against the simulated encoder: SAA manual 5.1.7 (5) 3 and 4.
#include "drivers/saa_modbus/operations.h"

#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>

#include "drivers/saa_modbus/bus_test_support.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;
using testing::ElementsAre;
using testing::HasSubstr;

const ByteList kOneBecomesTwo = {0x01, 0xA1, 0x02, 0xD8, 0x51};  // golden/requests.txt

class SetAddressTest : public testing::Test {
 protected:
  SetAddressTest() : machine_("axis1: {bits: 16}", "axis1: {start_deg: 90}") { machine_.Run(300 * kMillisecond); }

  Machine machine_;
};

TEST_F(SetAddressTest, TheDriverFollows) {
  const Outcome outcome = machine_.Do("set_address", {{"address", "2"}});
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_TRUE(outcome.verified);
  EXPECT_THAT(outcome.text, HasSubstr("put address: 2 into the file"));
  EXPECT_EQ(ChangeOf(outcome, "address").before, "1");
  EXPECT_EQ(ChangeOf(outcome, "address").after, "2");
  EXPECT_THAT(machine_.port->Changes(), ElementsAre(kOneBecomesTwo));
  EXPECT_GT(machine_.port->rest(), 50 * kMillisecond) << "the encoder may need time";
  EXPECT_EQ(machine_.State("address"), "2");
  EXPECT_EQ(machine_.Alarm(), AlarmState::kLive);
  EXPECT_EQ(machine_.output().nv_writes, 1);
  EXPECT_EQ(machine_.output().jumps, 0);
  EXPECT_TRUE(machine_.output().errors.empty()) << "silence at the new address is no fault";
  const std::size_t before = machine_.output().samples.size();
  machine_.Run(kSecond);
  EXPECT_GT(machine_.output().samples.size(), before + 10);
  EXPECT_EQ(machine_.output().samples.back().counts, 16'384);
  machine_.Run(10 * kSecond);
  EXPECT_EQ(machine_.Do("set_address", {{"address", "1"}}).state, CommandState::kSucceeded);
  EXPECT_EQ(machine_.Alarm(), AlarmState::kAbsent) << "as in the file again";
}

TEST_F(SetAddressTest, WhenTheReplyIsLostItLooksWhereTheEncoderAnswers) {
  machine_.Begin("set_address", {{"address", "2"}});
  machine_.RunToTheChange();
  machine_.Set("axis1", "fault", "intermittent:1");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "fault", "none");
  EXPECT_EQ(machine_.Finish().state, CommandState::kSucceeded);
  EXPECT_EQ(machine_.port->Changes().size(), 1U);
}

TEST_F(SetAddressTest, FailsWhenTheEncoderKeepsItsAddress) {
  machine_.Begin("set_address", {{"address", "2"}});
  machine_.RunToTheChange();
  machine_.Set("axis1", "power", "off");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "power", "on");
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(outcome.reason, Reason::REASON_READ_BACK_DIFFERS);
  EXPECT_THAT(outcome.text, HasSubstr("still answers at address 1"));
  EXPECT_EQ(machine_.Alarm(), AlarmState::kAbsent);
}

TEST_F(SetAddressTest, SaysThatItLostTheEncoderAndFindsItAgain) {
  machine_.Begin("set_address", {{"address", "2"}});
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "power", "off");
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate);
  EXPECT_THAT(outcome.text, HasSubstr("read_position after=\"set_address address=2\""));
  machine_.Set("axis1", "power", "on");
  const Outcome found = machine_.Do("read_position", {{"after", "set_address address=2"}});
  EXPECT_EQ(ChangeOf(found, "finding").after, "reads_as_after");
  EXPECT_EQ(ChangeOf(found, "address").after, "2");
  machine_.Run(kSecond);
  EXPECT_EQ(machine_.output().samples.back().counts, 16'384);
}

// A new driver process that knows of no order.
TEST(SetAddress, LookingForTheChangeFindsTheEncoderInANewProcess) {
  Machine machine("axis1: {bits: 16}", "axis1: {address: 2, start_deg: 90}");
  machine.Run(kSecond);
  const Outcome found = machine.Do("read_position", {{"after", "set_address address=2"}});
  EXPECT_EQ(ChangeOf(found, "finding").after, "reads_as_after");
  machine.Run(kSecond);
  ASSERT_FALSE(machine.output().samples.empty());
  EXPECT_EQ(machine.output().samples.back().counts, 16'384);
}

TEST_F(SetAddressTest, LookingForAChangeNowhereFails) {
  machine_.Set("axis1", "power", "off");
  machine_.Run(kSecond);
  const Outcome found = machine_.Do("read_position", {{"after", "set_address address=2"}});
  EXPECT_EQ(found.state, CommandState::kFailed);
  EXPECT_THAT(found.text, HasSubstr("neither at its old place nor at the one after"));
}

TEST_F(SetAddressTest, ALinkLostAfterTheRequestIsIndeterminate) {
  machine_.Begin("set_address", {{"address", "2"}});
  machine_.RunThroughTheChange();
  machine_.port->Unplug();
  EXPECT_EQ(machine_.Finish().state, CommandState::kIndeterminate);
}

TEST_F(SetAddressTest, RefusesBadArguments) {
  for (const char* address : {"", "0", "248", "255", "two", "-1"}) {
    EXPECT_EQ(machine_.Do("set_address", {{"address", address}}).reason, Reason::REASON_BAD_ARGUMENT) << address;
    EXPECT_EQ(machine_.Do("set_address", {{"address", "2"}, {"from", address}}).reason,
              Reason::REASON_BAD_ARGUMENT);
  }
  EXPECT_EQ(machine_.Do("set_address").reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_TRUE(machine_.port->Changes().empty());
}

TEST_F(SetAddressTest, TheSameAddressIsNotWritten) {
  const Outcome outcome = machine_.Do("set_address", {{"address", "1"}});
  EXPECT_EQ(outcome.state, CommandState::kSucceeded);
  EXPECT_THAT(outcome.text, HasSubstr("nothing was written"));
  EXPECT_TRUE(machine_.port->Changes().empty());
}

// An encoder as delivered (address 1) is given the address of the file.
TEST(SetAddress, FromAnotherAddressThanTheFiles) {
  Machine machine("axis1: {bits: 16, address: 5}", "axis1: {address: 1}");
  machine.Run(kSecond);
  EXPECT_TRUE(machine.output().samples.empty());
  EXPECT_EQ(machine.Do("zero").reason, Reason::REASON_DEVICE_OFFLINE);
  const Outcome asked = machine.Do("query_address");
  EXPECT_THAT(asked.text, HasSubstr("set_address address=5 from=1"));
  EXPECT_EQ(ChangeOf(asked, "address").after, "1");
  const Outcome outcome = machine.Do("set_address", {{"address", "5"}, {"from", "1"}});
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  machine.Run(kSecond);
  EXPECT_FALSE(machine.output().samples.empty());
  EXPECT_EQ(machine.Alarm(), AlarmState::kAbsent);
}

TEST(SetAddress, FromWhereNobodyAnswersNothingIsDone) {
  Machine machine("axis1: {bits: 16}");
  machine.Run(300 * kMillisecond);
  const Outcome outcome = machine.Do("set_address", {{"address", "5"}, {"from", "9"}});
  EXPECT_EQ(outcome.state, CommandState::kRejected);
  EXPECT_THAT(outcome.text, HasSubstr("no encoder answers at address 9"));
  EXPECT_TRUE(machine.port->Changes().empty());
}

// Two encoders with one address could not be distinguished again.
TEST(SetAddress, NeverToOneThatIsTaken) {
  Machine machine("axis1: {bits: 16, address: 1}, axis2: {bits: 16, address: 2}");
  machine.Run(300 * kMillisecond);
  EXPECT_EQ(machine.Do("set_address", {{"address", "2"}}).reason, Reason::REASON_NOT_PERMITTED);
  EXPECT_EQ(machine.Do("set_address", {{"address", "9"}, {"from", "2"}}).reason, Reason::REASON_NOT_PERMITTED);
  machine.Set("axis2", "address", "7");  // not the address of the file
  const Outcome outcome = machine.Do("set_address", {{"address", "7"}});
  EXPECT_EQ(outcome.reason, Reason::REASON_NOT_PERMITTED) << outcome.text;
  EXPECT_THAT(outcome.text, HasSubstr("something answers at address 7"));
  machine.Set("axis2", "fault", "garbage");
  EXPECT_EQ(machine.Do("set_address", {{"address", "7"}}).reason, Reason::REASON_NOT_PERMITTED);
  machine.Set("axis2", "fault", "none");
  EXPECT_TRUE(machine.port->Changes().empty());
  EXPECT_EQ(machine.Do("set_address", {{"address", "9"}}).state, CommandState::kSucceeded);
  EXPECT_EQ(machine.State("address", 0), "9");
  EXPECT_EQ(machine.State("address", 1), "7");
}

TEST(SetAddress, AskThreeTimesWhetherAnAddressIsFree) {
  Machine machine("axis1: {bits: 16, address: 1}");
  machine.Run(300 * kMillisecond);
  EXPECT_EQ(machine.Do("set_address", {{"address", "7"}}).state, CommandState::kSucceeded);
  const auto& written = machine.port->written();
  const auto change = std::find(written.begin(), written.end(), ByteList{0x01, 0xA1, 0x07, 0x18, 0x52});
  ASSERT_NE(change, written.end());
  EXPECT_EQ(std::count_if(written.begin(), change, [](const ByteList& request) { return request[0] == 7; }), 3);
}

// An answer to a request for another address is not the position of this encoder.
TEST(SetAddress, WhatAnotherEncoderAnswersIsNoReading) {
  Machine machine("axis1: {bits: 16, address: 1}, axis2: {bits: 16, address: 2}", "axis2: {start_deg: 180}");
  machine.Run(300 * kMillisecond);
  // An order that was not carried out leaves no trace: the encoder stays the one at address 1.
  machine.Begin("set_address", {{"address", "7"}});
  machine.RunToTheChange();
  machine.Set("axis1", "power", "off");
  machine.RunThroughTheChange();
  machine.Set("axis1", "power", "on");
  EXPECT_EQ(machine.Finish().state, CommandState::kFailed);
  machine.Set("axis2", "address", "7");
  machine.Run(11 * kSecond);
  EXPECT_EQ(machine.Do("set_address", {{"address", "7"}}).reason, Reason::REASON_NOT_PERMITTED);
  machine.Run(kSecond);
  for (const Sample& sample : machine.output().samples) EXPECT_EQ(sample.counts, 0);
}

// ---- query_address ----

TEST(QueryAddress, TakesTheReplysCrcInEitherOrder) {
  for (const char* order : {"msb_first", "lsb_first"}) {
    Machine machine("axis1: {bits: 16, address: 9}", "axis1: {query_crc: " + std::string(order) + "}");
    machine.Run(300 * kMillisecond);
    const Outcome outcome = machine.Do("query_address");
    EXPECT_EQ(outcome.state, CommandState::kSucceeded) << order << ": " << outcome.text;
    EXPECT_TRUE(outcome.verified);
    EXPECT_EQ(ChangeOf(outcome, "address").after, "9");
    const ByteList query = {0xFF, 0xA0, 0x40, 0x38};
    EXPECT_THAT(machine.port->written(), testing::Contains(query));
    EXPECT_TRUE(machine.output().errors.empty());
  }
}

TEST(QueryAddress, IsForAnEncoderAlone) {
  Machine machine("axis1: {bits: 16, address: 1}, axis2: {bits: 16, address: 2}");
  machine.Run(300 * kMillisecond);
  const Outcome outcome = machine.Do("query_address");
  EXPECT_EQ(outcome.reason, Reason::REASON_NOT_PERMITTED);
  EXPECT_THAT(outcome.text, HasSubstr("all would answer at once"));
  EXPECT_EQ(machine.State("collisions"), "0");
}

TEST(QueryAddress, FailsWhenNobodyAnswers) {
  Machine machine("axis1: {bits: 16}", "axis1: {power: off}");
  machine.Run(kSecond);
  const Outcome outcome = machine.Do("query_address");
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(outcome.reason, Reason::REASON_NO_REPLY);
}

// ---- read_position ----

// 5.1.7 (7): 383 at 14 bits is 8.4155 degrees.
TEST(ReadPosition, ShowsTheManualsExample) {
  Machine machine("axis1: {bits: 14}", "axis1: {start_deg: 8.4265}");
  machine.Run(300 * kMillisecond);
  const Outcome outcome = machine.Do("read_position");
  EXPECT_EQ(outcome.text, "counts 383, 8.4155 deg");
  EXPECT_TRUE(outcome.verified);
  EXPECT_EQ(ChangeOf(outcome, "single_turn").after, "383");
}

TEST(ReadPosition, JudgesTheEffectOfAnotherOrder) {
  Machine machine("axis1: {bits: 16}", "axis1: {start_deg: 90}");
  machine.Run(300 * kMillisecond);
  const auto finding = [&](const char* after) {
    return ChangeOf(machine.Do("read_position", {{"after", after}}), "finding").after;
  };
  EXPECT_EQ(finding("zero"), "no_effect_seen");
  EXPECT_EQ(finding("set_direction direction=negative"), "cannot_tell");
  EXPECT_EQ(finding("set_address address=2"), "no_effect_seen");
  machine.Set("axis1", "speed_rpm", "60");
  machine.Run(300 * kMillisecond);
  EXPECT_EQ(finding("zero"), "cannot_tell") << "it may have left the place where it was zeroed";
  for (const char* after :
       {"", "zeroo", "set_baud", "set_baud baud=1", "set_address", "set_direction direction=up"}) {
    EXPECT_EQ(machine.Do("read_position", {{"after", after}}).reason, Reason::REASON_BAD_ARGUMENT) << after;
  }
}

TEST(ReadPosition, FailsAfterThreeTries) {
  Machine machine("axis1: {bits: 16}");
  machine.Run(300 * kMillisecond);
  machine.Begin("read_position");
  machine.Set("axis1", "fault", "off");
  const Outcome outcome = machine.Finish();
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_THAT(outcome.text, HasSubstr("asked 3 times in vain (timeout)"));
}

}  // namespace
}  // namespace axlecast::saa_modbus
