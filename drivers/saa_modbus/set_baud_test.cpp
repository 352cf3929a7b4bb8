// set_baud against the simulated encoder, in virtual time: SAA manual 5.1.7 (2) and (5) 5.
#include "drivers/saa_modbus/operations.h"

#include <gmock/gmock.h>

#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <string>

#include "drivers/saa_modbus/bus_test_support.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;
using testing::HasSubstr;

class SetBaudTest : public testing::Test {
 protected:
  SetBaudTest() : machine_("axis1: {bits: 16}", "axis1: {start_deg: 90}") { machine_.Run(300 * kMillisecond); }

  Outcome Change(std::int64_t baud) { return machine_.Do("set_baud", {{"baud", std::to_string(baud)}}); }
  // New readings come, all of them right.
  void ExpectReadings() {
    const std::size_t before = machine_.output().samples.size();
    machine_.Run(2 * kSecond);
    EXPECT_GT(machine_.output().samples.size(), before + 5);
    EXPECT_EQ(machine_.output().samples.back().counts, 16'384);
  }

  Machine machine_;
};

TEST_F(SetBaudTest, TheDriverFollowsToEveryRateAndBack) {
  for (const auto& [baud, code] :
       {std::pair{2'400, 0x24}, {4'800, 0x48}, {9'600, 0x96}, {57'600, 0x57}, {19'200, 0x19}}) {
    const auto errors = machine_.output().errors.size();
    const Outcome outcome = Change(baud);
    EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
    EXPECT_TRUE(outcome.verified);
    EXPECT_EQ(ChangeOf(outcome, "baud").after, std::to_string(baud));
    EXPECT_EQ(machine_.port->Changes().back()[2], code);
    EXPECT_GT(machine_.port->rest(), 50 * kMillisecond) << "the encoder may need time";
    EXPECT_EQ(machine_.State("baud"), std::to_string(baud));
    EXPECT_EQ(machine_.port->baud(), baud);
    EXPECT_EQ(machine_.Alarm(), baud == 19'200 ? AlarmState::kAbsent : AlarmState::kLive) << baud;
    ExpectReadings();
    EXPECT_EQ(machine_.output().errors.size(), errors) << baud;
    EXPECT_EQ(machine_.State("short_gaps"), "0") << baud;
    machine_.Run(10 * kSecond);
  }
  EXPECT_EQ(machine_.State("writes"), "5");
  EXPECT_EQ(machine_.output().jumps, 0) << "the position is the same";
}

TEST_F(SetBaudTest, SaysWhatToPutIntoTheFile) {
  EXPECT_THAT(Change(57'600).text, HasSubstr("put link.baud: 57600 into the file"));
}

// README.md, "Alarms": the action for the operator, in a text that fits its message.
TEST_F(SetBaudTest, TheAlarmNamesWhatToChange) {
  EXPECT_EQ(Change(57'600).state, CommandState::kSucceeded);
  ASSERT_EQ(machine_.Alarm(), AlarmState::kLive);
  const AlarmSpec& alarm = machine_.output().alarm_specs.at(0x200);
  EXPECT_STREQ(alarm.name, "configuration_differs");
  EXPECT_EQ(alarm.severity, alarm_entry_t::SEVERITY_WARNING);
  const std::string action = alarm.action;
  for (const char* part : {"link.baud", "address", "in the file", "restart"}) EXPECT_THAT(action, HasSubstr(part));
  EXPECT_LE(action.size(), 80U);
}

// At which rate the reply comes is not documented.
TEST_F(SetBaudTest, TheReplyMayComeAtTheNewRate) {
  machine_.Set("axis1", "baud_reply", "new");
  const Outcome outcome = Change(57'600);
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_EQ(machine_.port->Changes().size(), 1U);
  ExpectReadings();
}

TEST_F(SetBaudTest, APortThatCannotDoTheRateCostsNothing) {
  machine_.port->RefuseBaud(57'600);
  const Outcome outcome = Change(57'600);
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_THAT(outcome.text, HasSubstr("nothing was done: the port cannot do 57600 Bd"));
  EXPECT_TRUE(machine_.port->Changes().empty());
  ExpectReadings();
  EXPECT_EQ(machine_.Alarm(), AlarmState::kAbsent);
}

TEST_F(SetBaudTest, FailsWhenTheEncoderKeepsItsRate) {
  machine_.Begin("set_baud", {{"baud", "57600"}});
  machine_.RunToTheChange();
  machine_.Set("axis1", "power", "off");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "power", "on");
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(outcome.reason, Reason::REASON_READ_BACK_DIFFERS);
  EXPECT_THAT(outcome.text, HasSubstr("still answers at 19200 Bd"));
  ExpectReadings();
  EXPECT_EQ(machine_.port->baud(), 19'200);
}

TEST_F(SetBaudTest, SaysThatItLostTheEncoderAndFindsItAgain) {
  machine_.Begin("set_baud", {{"baud", "57600"}});
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "power", "off");
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate);
  EXPECT_THAT(outcome.text,
              HasSubstr("turn its power off and on, then read_position after=\"set_baud baud=57600\""));
  machine_.Set("axis1", "power", "on");
  machine_.Run(kSecond);
  EXPECT_EQ(machine_.State("baud"), "57600");
  const Outcome found = machine_.Do("read_position", {{"after", "set_baud baud=57600"}});
  EXPECT_EQ(found.state, CommandState::kSucceeded) << found.text;
  EXPECT_EQ(ChangeOf(found, "finding").after, "reads_as_after");
  ExpectReadings();
  EXPECT_EQ(machine_.Alarm(), AlarmState::kLive);
}

TEST_F(SetBaudTest, LookingForAChangeThatDidNotHappenSaysSo) {
  const Outcome found = machine_.Do("read_position", {{"after", "set_baud baud=57600"}});
  EXPECT_EQ(ChangeOf(found, "finding").after, "no_effect_seen");
  EXPECT_EQ(ChangeOf(found, "baud").after, "19200");
  ExpectReadings();
}

// Trying the port at another rate is the begin of the order.
TEST_F(SetBaudTest, DoesNotExpireOnceThePortWasTried) {
  const MonoNs now = machine_.clock.Now();
  DriverCommand order{
      .id = {1, 2, 3}, .operation = "read_position", .arguments = {{"after", "set_baud baud=57600"}}};
  order.begin_by = now;
  Device& device = machine_.device();
  device.Begin(order, now);
  const Step step = device.Next({.now = now});
  ASSERT_TRUE(std::holds_alternative<SetBaudRate>(step.action));
  device.OnStarted(step, now);
  const MonoNs later = now + kSecond;
  device.On(
      {.kind = Event::Kind::kBaudRateSet, .sent = {}, .received = {later, later}, .request = {}, .bytes = {}});
  EXPECT_TRUE(machine_.output().outcomes.empty());
}

TEST_F(SetBaudTest, KeepsTheNewRateWhenTheLineIsOpenedAgain) {
  EXPECT_EQ(Change(57'600).state, CommandState::kSucceeded);
  machine_.port->Unplug();
  machine_.Run(kSecond);
  machine_.port->Plug();
  machine_.Run(3 * kSecond);
  ExpectReadings();
  EXPECT_EQ(machine_.port->baud(), 57'600);
}

TEST_F(SetBaudTest, ALinkLostAfterTheRequestIsIndeterminate) {
  machine_.Begin("set_baud", {{"baud", "57600"}});
  machine_.RunThroughTheChange();
  machine_.port->Unplug();
  EXPECT_EQ(machine_.Finish().state, CommandState::kIndeterminate);
}

TEST_F(SetBaudTest, TheSameRateIsNotWritten) {
  const Outcome outcome = Change(19'200);
  EXPECT_EQ(outcome.state, CommandState::kSucceeded);
  EXPECT_THAT(outcome.text, HasSubstr("nothing was written"));
  EXPECT_TRUE(machine_.port->Changes().empty());
}

TEST_F(SetBaudTest, RefusesOtherRates) {
  for (const char* baud : {"", "38400", "115200", "0", "-2400", "fast"}) {
    const Outcome outcome = machine_.Do("set_baud", {{"baud", baud}});
    EXPECT_EQ(outcome.reason, Reason::REASON_BAD_ARGUMENT) << baud;
    EXPECT_THAT(outcome.text, HasSubstr("2400, 4800, 9600, 19200 or 57600"));
  }
}

TEST(SetBaud, IsForAnEncoderAlone) {
  Machine machine("axis1: {bits: 16, address: 1}, axis2: {bits: 16, address: 2}");
  machine.Run(300 * kMillisecond);
  const Outcome outcome = machine.Do("set_baud", {{"baud", "57600"}});
  EXPECT_EQ(outcome.reason, Reason::REASON_NOT_PERMITTED);
  EXPECT_THAT(outcome.text, HasSubstr("connect this one alone"));
  EXPECT_TRUE(machine.port->Changes().empty());
}

}  // namespace
}  // namespace axlecast::saa_modbus
