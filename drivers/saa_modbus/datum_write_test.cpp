// zero and set_direction against the simulated encoder, in virtual time: SAA manual 5.1.7 (5) 5.
#include "drivers/saa_modbus/operations.h"

#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>

#include "drivers/saa_modbus/bus_test_support.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;
using testing::ElementsAre;
using testing::HasSubstr;

const ByteList kZeroRequest = {0x01, 0xCC, 0x00, 0x75, 0x00};  // golden/requests.txt
const ByteList kNegativeRequest = {0x01, 0xCC, 0x02, 0xF4, 0xC1};

// One encoder of 16 bits whose shaft is at 90 degrees, while it is read.
class DatumWriteTest : public testing::Test {
 protected:
  DatumWriteTest() : machine_("axis1: {bits: 16}", "axis1: {start_deg: 90}") { machine_.Run(300 * kMillisecond); }

  Machine machine_;
  Watch& output_ = machine_.output();
};

TEST_F(DatumWriteTest, ZeroesAndVerifies) {
  const Outcome outcome = machine_.Do("zero");
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_TRUE(outcome.verified);
  EXPECT_EQ(ChangeOf(outcome, "single_turn").before, "16384");
  EXPECT_EQ(ChangeOf(outcome, "single_turn").after, "0");
  EXPECT_THAT(machine_.port->Changes(), ElementsAre(kZeroRequest));
  EXPECT_EQ(machine_.State("writes"), "1");
  EXPECT_EQ(output_.nv_writes, 1);
  EXPECT_EQ(output_.jumps, 1);
  EXPECT_FALSE(output_.datum_changing);
  EXPECT_EQ(output_.samples.back().counts, 0);
}

TEST_F(DatumWriteTest, TheProgressTellsThePositionBefore) {
  machine_.Begin("zero");
  machine_.RunToTheChange();
  EXPECT_EQ(ChangeOf(output_.outcomes.back().second, "single_turn").before, "16384");
  EXPECT_EQ(machine_.Finish().state, CommandState::kSucceeded);
}

TEST_F(DatumWriteTest, IsRejectedWhileTheShaftTurns) {
  machine_.Set("axis1", "speed_rpm", "60");
  machine_.Run(300 * kMillisecond);
  for (const auto& [operation, arguments] :
       {std::pair<std::string, Arguments>{"zero", {}}, {"set_direction", {{"direction", "negative"}}}}) {
    const Outcome outcome = machine_.Do(operation, arguments);
    EXPECT_EQ(outcome.state, CommandState::kRejected);
    EXPECT_EQ(outcome.reason, Reason::REASON_NOT_STANDING_STILL);
    EXPECT_THAT(outcome.text, HasSubstr("rpm"));
  }
  EXPECT_TRUE(machine_.port->Changes().empty());
  EXPECT_EQ(machine_.State("writes"), "0");
}

TEST_F(DatumWriteTest, AShaftThatStartsToTurnBeforeTheRequestEndsIt) {
  machine_.Set("axis1", "accel_rad_s2", "100000");
  machine_.Begin("zero");
  machine_.Set("axis1", "speed_rpm", "300");
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.reason, Reason::REASON_NOT_STANDING_STILL) << outcome.text;
  EXPECT_TRUE(machine_.port->Changes().empty());
}

TEST_F(DatumWriteTest, WithoutFreshReadingsNobodyKnowsThatItRests) {
  output_.samples.clear();
  const Outcome outcome = machine_.Do("zero");
  EXPECT_EQ(outcome.reason, Reason::REASON_NOT_STANDING_STILL);
  EXPECT_THAT(outcome.text, HasSubstr("poll faster"));
}

TEST_F(DatumWriteTest, WhenTheEchoIsLostTheReadingDecides) {
  machine_.Begin("zero");
  machine_.RunToTheChange();
  machine_.Set("axis1", "fault", "intermittent:1");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "fault", "none");
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_THAT(outcome.text, HasSubstr("the echo did not come"));
  EXPECT_EQ(machine_.port->Changes().size(), 1U) << "never sent twice";
}

TEST_F(DatumWriteTest, WhenItReadZeroBeforeALostEchoLeavesItOpen) {
  machine_.Set("axis1", "zero_deg", "90");
  machine_.Run(500 * kMillisecond);
  machine_.Begin("zero");
  machine_.RunToTheChange();
  machine_.Set("axis1", "fault", "intermittent:1");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "fault", "none");
  EXPECT_EQ(machine_.Finish().state, CommandState::kIndeterminate);
}

// It read the same before, and was silent after its echo: its power may have failed before it stored anything.
TEST_F(DatumWriteTest, AnEncoderThatWasSilentAfterItsEchoMayHaveStoredNothing) {
  machine_.Set("axis1", "zero_deg", "90");
  machine_.Run(500 * kMillisecond);
  for (const auto& [operation, arguments] :
       {std::pair<std::string, Arguments>{"zero", {}}, {"set_direction", {{"direction", "negative"}}}}) {
    machine_.Begin(operation, arguments);
    const std::size_t changes = machine_.port->Changes().size();
    ASSERT_TRUE(machine_.RunUntil([&] { return machine_.port->Changes().size() > changes; }));
    machine_.Run(kMillisecond);
    machine_.Set("axis1", "power", "off");
    machine_.Run(20 * kMillisecond);
    machine_.Set("axis1", "power", "on");
    const Outcome outcome = machine_.Finish();
    EXPECT_EQ(outcome.state, CommandState::kIndeterminate) << outcome.text;
    EXPECT_THAT(outcome.text, HasSubstr("silent"));
    EXPECT_LE(outcome.text.size(), 200U);
    machine_.Run(11 * kSecond);
  }
}

TEST_F(DatumWriteTest, FailsWhenTheReadBackIsNotZero) {
  machine_.Begin("zero");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "zero_deg", "89");
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(outcome.reason, Reason::REASON_READ_BACK_DIFFERS);
  EXPECT_THAT(outcome.text, HasSubstr("is counts 182, 0.9998 deg, not 0"));
  EXPECT_EQ(output_.jumps, 1) << "the epoch rises even when the effect is in doubt";
}

TEST_F(DatumWriteTest, LooksAgainWhenTheEffectIsLate) {
  machine_.Begin("zero");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "zero_deg", "89");
  machine_.Run(20 * kMillisecond);
  machine_.Set("axis1", "zero_deg", "90");
  EXPECT_EQ(machine_.Finish().state, CommandState::kSucceeded);
}

// "Set the current position to zero" names no tolerance: 0.1 degrees, and the accuracy of table 4.1 twice.
TEST(ZeroTolerance, IsATenthOfADegreeAndTheAccuracy) {
  EXPECT_EQ(ZeroToleranceCounts(10), 2 + 1);
  EXPECT_EQ(ZeroToleranceCounts(16), 18 + 5);
  EXPECT_EQ(ZeroToleranceCounts(26), 18'641 + 518);
}

TEST_F(DatumWriteTest, IsIndeterminateWhenNothingCanBeReadAfterwards) {
  machine_.Begin("zero");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "power", "off");
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate);
  EXPECT_TRUE(output_.datum_changing) << "until the next reading";
  machine_.Set("axis1", "power", "on");
  machine_.Run(3 * kSecond);
  EXPECT_FALSE(output_.datum_changing);
  EXPECT_EQ(output_.jumps, 1);
}

TEST_F(DatumWriteTest, ALinkLostAfterTheRequestIsIndeterminateAndIsLookedInto) {
  machine_.Begin("zero");
  machine_.RunThroughTheChange();
  machine_.port->Unplug();
  EXPECT_EQ(machine_.Finish().state, CommandState::kIndeterminate);
  machine_.port->Plug();
  machine_.Run(5 * kSecond);
  const Outcome found = machine_.Do("read_position", {{"after", "zero"}});
  EXPECT_EQ(found.state, CommandState::kSucceeded) << found.text;
  EXPECT_EQ(ChangeOf(found, "finding").after, "reads_as_after");
}

// The link goes while the request is on its way: it may have been carried out.
TEST_F(DatumWriteTest, ALinkLostDuringTheRequestCountsAsAWrite) {
  machine_.Begin("zero");
  machine_.RunToTheChange();
  const MonoNs now = machine_.clock.Now() + kSecond / 10;
  machine_.device().OnStarted(machine_.device().Next({.now = now}), now);
  machine_.device().On(
      {.kind = Event::Kind::kLinkDown, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}});
  EXPECT_EQ(output_.outcomes.back().second.state, CommandState::kIndeterminate);
  EXPECT_EQ(output_.nv_writes, 1);
  EXPECT_TRUE(output_.datum_changing);
}

TEST_F(DatumWriteTest, ALinkLostBeforeTheRequestChangedNothing) {
  machine_.Begin("zero");
  machine_.RunToTheChange();
  machine_.port->Unplug();
  const Outcome outcome = machine_.Finish();
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_THAT(outcome.text, HasSubstr("nothing was done"));
  EXPECT_EQ(machine_.State("writes"), "0");
}

TEST_F(DatumWriteTest, ADirectionIsAcceptedButCannotBeVerifiedAtRest) {
  const Outcome outcome = machine_.Do("set_direction", {{"direction", "negative"}});
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_FALSE(outcome.verified);
  EXPECT_THAT(machine_.port->Changes(), ElementsAre(kNegativeRequest));
  EXPECT_EQ(machine_.State("counting"), "negative");
  EXPECT_EQ(ChangeOf(outcome, "single_turn").before, "16384");
  EXPECT_EQ(ChangeOf(outcome, "single_turn").after, "49152") << "270 degrees";
  EXPECT_EQ(output_.jumps, 1);
  machine_.Run(11 * kSecond);
  EXPECT_EQ(machine_.Do("set_direction", {{"direction", "positive"}}).state, CommandState::kSucceeded);
  EXPECT_EQ(machine_.State("counting"), "positive");
}

TEST_F(DatumWriteTest, ADirectionWithoutItsEchoIsIndeterminate) {
  machine_.Begin("set_direction", {{"direction", "negative"}});
  machine_.RunToTheChange();
  machine_.Set("axis1", "fault", "intermittent:1");
  machine_.RunThroughTheChange();
  machine_.Set("axis1", "fault", "none");
  EXPECT_EQ(machine_.Finish().state, CommandState::kIndeterminate);
}

// "When changing parameters, do not regularly send in case the internal structure of the device would be damaged."
TEST_F(DatumWriteTest, WritesAreRateLimited) {
  EXPECT_EQ(machine_.Do("zero").state, CommandState::kSucceeded);
  machine_.Run(5 * kSecond);
  for (const auto& [operation, arguments] : {std::pair<std::string, Arguments>{"zero", {}},
                                             {"set_direction", {{"direction", "positive"}}},
                                             {"set_baud", {{"baud", "9600"}}},
                                             {"set_address", {{"address", "9"}}}}) {
    const Outcome outcome = machine_.Do(operation, arguments);
    EXPECT_EQ(outcome.state, CommandState::kRejected) << operation;
    EXPECT_EQ(outcome.reason, Reason::REASON_WEAR) << operation;
    EXPECT_THAT(outcome.text, HasSubstr("one write in 10 s"));
  }
  EXPECT_EQ(machine_.Do("read_position").state, CommandState::kSucceeded) << "reading is no write";
  EXPECT_EQ(machine_.Do("query_address").state, CommandState::kSucceeded);
  EXPECT_EQ(machine_.State("writes"), "1");
  machine_.Run(6 * kSecond);
  EXPECT_EQ(machine_.Do("zero").state, CommandState::kSucceeded);
  EXPECT_EQ(machine_.State("writes"), "2");
}

// ---- orders as such ----

TEST_F(DatumWriteTest, CanBeCancelledUntilTheRequestIsSent) {
  const CommandId id = {1, 2, 3};
  machine_.Begin("zero");
  machine_.RunToTheChange();
  EXPECT_FALSE(machine_.device().Cancel({9}, machine_.clock.Now())) << "another order";
  EXPECT_TRUE(machine_.device().Cancel(id, machine_.clock.Now()));
  machine_.Run(kSecond);
  EXPECT_EQ(machine_.State("writes"), "0");
  machine_.Begin("zero");
  machine_.RunThroughTheChange();
  EXPECT_FALSE(machine_.device().Cancel(id, machine_.clock.Now()));
}

TEST_F(DatumWriteTest, ExpiresWhenItCannotBegin) {
  DriverCommand order{.id = {1, 2, 3}, .operation = "zero", .arguments = {}};
  order.begin_by = machine_.clock.Now() - 1;
  machine_.device().Begin(order, machine_.clock.Now());
  ASSERT_EQ(output_.outcomes.size(), 1U);
  EXPECT_EQ(output_.outcomes.back().second.state, CommandState::kExpired);
  order.begin_by = machine_.clock.Now();
  machine_.device().Begin(order, machine_.clock.Now());
  machine_.clock.Advance(1);
  machine_.Run(kSecond);
  ASSERT_EQ(output_.outcomes.size(), 2U);
  EXPECT_EQ(output_.outcomes.back().second.state, CommandState::kExpired);
  EXPECT_EQ(machine_.State("writes"), "0");
}

TEST_F(DatumWriteTest, OneOrderAtATime) {
  machine_.Begin("zero");
  machine_.Begin("read_position");
  ASSERT_EQ(output_.outcomes.size(), 1U);
  EXPECT_EQ(output_.outcomes.back().second.reason, Reason::REASON_BUSY);
}

TEST_F(DatumWriteTest, RefusesWhatIsNoDirectionAndNoOperation) {
  for (const char* direction : {"", "cw", "Positive", "1"}) {
    EXPECT_EQ(machine_.Do("set_direction", {{"direction", direction}}).reason, Reason::REASON_BAD_ARGUMENT);
  }
  EXPECT_EQ(machine_.Do("set_direction").reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_EQ(machine_.Do("reset_turns").reason, Reason::REASON_UNKNOWN_OPERATION);
  EXPECT_EQ(machine_.State("writes"), "0");
}

}  // namespace
}  // namespace axlecast::saa_modbus
