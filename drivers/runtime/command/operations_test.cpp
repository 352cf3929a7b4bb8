#include "drivers/runtime/command/operations.h"

#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>
#include <axlecast/position_t.hpp>

#include "core/command/commands.h"
#include "drivers/runtime/command/axis_commands.h"
#include "drivers/runtime/command/operations_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using Status = command_status_t;

TEST_F(OperationsTest, AnOrderGoesToItsDeviceAndItsOutcomeBack) {
  Online();
  const auto order = MakeOrder("touch");
  EXPECT_EQ(Do(order).state, Status::STATE_RUNNING);
  EXPECT_TRUE(operations_.Busy());
  DeviceAnswers();
  const driver_status_t answer = Answer(order);
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.verified, 1);
  EXPECT_EQ(answer.epoch_after, channel_.summary().datum_epoch);
  EXPECT_FALSE(operations_.Busy());
}

TEST_F(OperationsTest, OneAtATimePerDevice) {
  Online();
  const auto first = MakeOrder("touch");
  const auto second = MakeOrder("touch");
  Send(first);
  EXPECT_EQ(Do(second).state, Status::STATE_ROUTED);
  DeviceAnswers();
  operations_.Poll(clock_.Now());
  EXPECT_EQ(Answer(first).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(Answer(second).state, Status::STATE_RUNNING);
}

TEST_F(OperationsTest, AnotherEpochThanTheClientSawIsRefusedFirst) {
  auto order = MakeOrder("write");  // has no permit, and the device is offline: the epoch is judged before
  order.expect_epoch = channel_.summary().datum_epoch + 1;
  const driver_status_t answer = Do(order);
  EXPECT_EQ(answer.state, Status::STATE_REJECTED);
  EXPECT_EQ(answer.reason_code, Status::REASON_EPOCH);
  order = MakeOrder("touch");
  order.expect_epoch = channel_.summary().datum_epoch;
  Online();
  EXPECT_EQ(Do(order).state, Status::STATE_RUNNING);
}

TEST_F(OperationsTest, APermitIsNeededFreshAndForThisOperation) {
  Online();
  EXPECT_EQ(Do(MakeOrder("write")).reason_code, Status::REASON_NO_PERMIT);
  EXPECT_THAT(Do(MakeOrder("write")).text, HasSubstr("no PERMIT/axis1 came"));
  Permit("something_else");
  EXPECT_EQ(Do(MakeOrder("write")).reason_code, Status::REASON_NO_PERMIT);
  EXPECT_THAT(Do(MakeOrder("write")).text, HasSubstr("does not allow write"));
  Permit("write");
  EXPECT_EQ(Do(MakeOrder("write")).state, Status::STATE_RUNNING);
  DeviceAnswers();
  clock_.Advance(501 * kMillisecond);
  EXPECT_EQ(Do(MakeOrder("write")).reason_code, Status::REASON_NO_PERMIT);
  EXPECT_THAT(Do(MakeOrder("write")).text, HasSubstr("ended 0.001 s ago"));
}

TEST_F(OperationsTest, NoPermitWhereTheConfigurationSaysSo) {
  bus_.devices[0].permit_required = false;
  Online();
  EXPECT_EQ(Do(MakeOrder("write")).state, Status::STATE_RUNNING);
}

TEST_F(OperationsTest, ADeviceThatIsNotThereTakesNoOrder) {
  channel_.OnLink(false, "unplugged", clock_.Now());
  const driver_status_t answer = Do(MakeOrder("touch"));
  EXPECT_EQ(answer.state, Status::STATE_REJECTED);
  EXPECT_EQ(answer.reason_code, Status::REASON_DEVICE_OFFLINE);
  EXPECT_FALSE(operations_.Busy());
}

TEST_F(OperationsTest, AnOrderThatHasNotTouchedItsDeviceCanBeCancelled) {
  Online();
  auto order = MakeOrder("touch");
  Send(order);
  order.kind = driver_order_t::KIND_CANCEL;
  EXPECT_EQ(Do(order).state, Status::STATE_CANCELLED);
  EXPECT_FALSE(operations_.Busy());
}

TEST_F(OperationsTest, AnOrderThatHasTouchedItsDeviceGoesOn) {
  Online();
  auto order = MakeOrder("touch");
  Send(order);
  device_.OnStarted(device_.Next({.now = clock_.Now(), .poll_due = true}), clock_.Now());
  order.kind = driver_order_t::KIND_CANCEL;
  EXPECT_EQ(Do(order).state, Status::STATE_RUNNING);
  operations_.Abandon(clock_.Now());
  EXPECT_TRUE(operations_.Busy());
  DeviceAnswers();
  EXPECT_EQ(Answer(order).state, Status::STATE_SUCCEEDED);
}

TEST_F(OperationsTest, AbandonCancelsWhatHasNotBegun) {
  Online();
  const auto order = MakeOrder("touch");
  Send(order);
  operations_.Abandon(clock_.Now());
  EXPECT_EQ(Answer(order).state, Status::STATE_CANCELLED);
  EXPECT_EQ(Answer(order).reason_code, Status::REASON_STOPPING);
}

TEST_F(OperationsTest, WritesAreCountedFromTheBeginningOfTheOrder) {
  Online();
  channel_.OnNonVolatileWrite();
  const auto order = MakeOrder("touch");
  EXPECT_EQ(Do(order).nv_writes, 0);
  channel_.OnNonVolatileWrite();
  channel_.OnNonVolatileWrite();
  DeviceAnswers();
  EXPECT_EQ(Answer(order).nv_writes, 2);
  const auto next = MakeOrder("touch");
  Send(next);
  DeviceAnswers();
  EXPECT_EQ(Answer(next).nv_writes, 0);
}

TEST_F(OperationsTest, AnOrderThatTheStopCutsOffTellsItsWrites) {
  Online();
  const auto order = MakeOrder("touch");
  Send(order);
  channel_.OnNonVolatileWrite();
  operations_.CountWrites();
  server_.Goodbye();
  EXPECT_EQ(Answer(order).state, Status::STATE_INDETERMINATE);
  EXPECT_EQ(Answer(order).nv_writes, 1);
}

class PrepareOperationTest : public OperationsTest {
 protected:
  using OperationsTest::OperationsTest;
  driver_status_t Prepare(const std::string& operation, const std::vector<argument_t>& arguments = {}) {
    auto order = MakeOrder(operation, arguments);
    order.kind = driver_order_t::KIND_PREPARE;
    const driver_status_t answer = Do(order);
    EXPECT_EQ(answer.verified, 0);
    EXPECT_FALSE(operations_.Busy());
    return answer;
  }
};

TEST_F(PrepareOperationTest, SaysWhatWouldBeDoneAndDoesNothing) {
  Online();
  const driver_status_t answer = Prepare("touch");
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.text, "would do touch");
  EXPECT_EQ(answer.epoch_after, channel_.summary().datum_epoch);
  ASSERT_EQ(answer.n_changes, 1);
  EXPECT_EQ(answer.changes[0].key, "position");
  EXPECT_EQ(answer.changes[0].before, ValueText(channel_.summary().value));
  EXPECT_EQ(answer.changes[0].after, "");
  EXPECT_TRUE(device_.started.empty());
}

TEST_F(PrepareOperationTest, RefusesWhatExecuteWouldRefuse) {
  EXPECT_EQ(Prepare("touch").reason_code, Status::REASON_DEVICE_OFFLINE);
  Online();
  EXPECT_EQ(Prepare("write").reason_code, Status::REASON_NO_PERMIT);
  auto order = MakeOrder("touch");
  order.kind = driver_order_t::KIND_PREPARE;
  order.expect_epoch = channel_.summary().datum_epoch + 3;
  EXPECT_EQ(Do(order).reason_code, Status::REASON_EPOCH);
  device_.refuses = Error{.text = "the battery is at 2.4 V", .reason = Status::REASON_DEVICE_ALARM};
  const driver_status_t answer = Prepare("touch");
  EXPECT_EQ(answer.state, Status::STATE_REJECTED);
  EXPECT_EQ(answer.reason_code, Status::REASON_DEVICE_ALARM);
  EXPECT_EQ(answer.text, "nothing was done: the battery is at 2.4 V");
}

TEST_F(PrepareOperationTest, OfADatumShowsNowAndThen) {
  bus_.devices[0].unit = position_t::UNIT_COUNT;
  Online(1'000);
  const std::int32_t epoch = channel_.summary().datum_epoch;
  const driver_status_t set = Prepare("set_datum", {{"counts", "0"}});
  EXPECT_EQ(set.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(set.text, "would set the datum to 0 counts");
  ASSERT_EQ(set.n_changes, 3);
  EXPECT_EQ(set.changes[0].key, "value");
  EXPECT_EQ(set.changes[0].before, set.changes[0].after);  // none and 0 read the same
  EXPECT_EQ(set.changes[1].key, "datum_counts");
  EXPECT_EQ(set.changes[1].before, "none");
  EXPECT_EQ(set.changes[1].after, "0");
  EXPECT_EQ(Prepare("set_datum", {{"counts", "1000"}}).changes.at(0).after, "0");
  EXPECT_EQ(Prepare("set_datum", {{"value", "x"}}).reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Prepare("clear_datum").reason_code, Status::REASON_NO_DATUM);
  EXPECT_EQ(channel_.summary().datum_epoch, epoch);
  EXPECT_EQ(Prepare("mark_reference_lost").text, "would mark the reference as lost");
  EXPECT_FALSE(channel_.summary().reference_lost);
}

// Operations with arguments, of a family of their own.
class ArgumentOperationTest : public PrepareOperationTest {
 protected:
  static const Family& WritingFamily() {
    static const std::vector<OperationSpec> kOperations = {
        {.name = "store",
         .help = "writes as often as it is asked to",
         .arguments = {{"times", "how often"}, {"data", "hex", false}},
         .writes = [](const Arguments& arguments) { return std::stoi(arguments.at(0).second); }},
        {.name = "turn_back", .help = "needs a shaft at rest", .needs_standstill = true},
    };
    static const Family kFamily = {.name = "writing", .summary = "for tests", .operations = kOperations};
    return kFamily;
  }
  static BusConfig Bus() {
    BusConfig bus = PolledBus(1);
    bus.family = &WritingFamily();
    return bus;
  }
  ArgumentOperationTest() : PrepareOperationTest(Bus()) {}
};

TEST_F(ArgumentOperationTest, PrepareStatesTheArgumentsAndTheWrites) {
  Online();
  EXPECT_EQ(Prepare("store", {{"times", "2"}, {"data", "A105"}}).text,
            "would do store times=2 data=A105; writes the device's memory at most 2 times");
  EXPECT_EQ(Prepare("store", {{"times", "1"}}).text,
            "would do store times=1; writes the device's memory at most 1 times");
  EXPECT_EQ(Prepare("store", {{"times", "0"}}).text, "would do store times=0");
}

TEST_F(ArgumentOperationTest, PrepareNeedsTheStandstillThatExecuteNeeds) {
  Online();
  EXPECT_EQ(Prepare("turn_back").state, Status::STATE_SUCCEEDED);
  for (std::int64_t counts = 1'000; counts < 30'000; counts += 500) {
    clock_.Advance(kMillisecond);
    channel_.OnSample({.at = {clock_.Now(), clock_.Now()}, .counts = counts});
  }
  EXPECT_EQ(Prepare("store", {{"times", "0"}}).state, Status::STATE_SUCCEEDED);
  const driver_status_t answer = Prepare("turn_back");
  EXPECT_EQ(answer.state, Status::STATE_REJECTED);
  EXPECT_EQ(answer.reason_code, Status::REASON_NOT_STANDING_STILL);
  EXPECT_THAT(answer.text, HasSubstr("nothing was done: the shaft turns"));
}

TEST_F(OperationsTest, WhatTheFamilyDoesNotDoItselfIsRefused) {
  static const std::vector<OperationSpec> kOperations = {
      {.name = "touch", .help = "is of the bridge here", .executed_by_bridge = true}};
  static const Family kOther = {.name = "other", .summary = "for tests", .operations = kOperations};
  Online();
  Operations other(kOther, server_, time_, [](LogLevel, std::string_view) {});
  other.Add(bus_.devices[0], channel_, device_);
  for (const char* operation : {"touch", "write"}) {
    driver_order_t order = MakeOrder(operation);
    order.kind = driver_order_t::KIND_PREPARE;
    server_.OnDriverCommand(Enveloped(order));
    other.Poll(clock_.Now());
    EXPECT_EQ(Answer(order).state, Status::STATE_REJECTED) << operation;
    EXPECT_EQ(Answer(order).reason_code, Status::REASON_UNKNOWN_OPERATION) << operation;
    EXPECT_THAT(Answer(order).text, HasSubstr("operations of other")) << operation;
  }
}

// ---- what is refused, and what is stated ----

TEST_F(OperationsTest, ADeviceThatIsStartingTakesNoOrder) {
  channel_.OnLink(true, "", clock_.Now());
  const driver_status_t answer = Do(MakeOrder("touch"));
  EXPECT_EQ(answer.reason_code, Status::REASON_DEVICE_OFFLINE);
  EXPECT_THAT(answer.text, HasSubstr("still starting"));
}

TEST_F(OperationsTest, TheEpochIsNamedThatIsInForce) {
  Online();
  auto order = MakeOrder("touch");
  order.expect_epoch = 0;
  EXPECT_EQ(Do(order).state, Status::STATE_RUNNING);
  DeviceAnswers();
  Send(MakeOrder("set_datum", {{"counts", "5"}}));
  order = MakeOrder("touch");
  order.expect_epoch = 0;
  EXPECT_EQ(Do(order).reason_code, Status::REASON_EPOCH);
  EXPECT_THAT(Last().text, HasSubstr("datum_epoch is 1, not 0"));
}

TEST_F(OperationsTest, OutcomesOfUnknownDevicesAndCommandsAreIgnored) {
  Online();
  const auto order = MakeOrder("touch");
  Send(order);
  operations_.OnOutcome("axis9", NumberedId(1), {.state = CommandState::kFailed});
  operations_.OnOutcome("axis1", NumberedId(99), {.state = CommandState::kFailed});
  EXPECT_EQ(Answer(order).state, Status::STATE_RUNNING);
  EXPECT_TRUE(operations_.Busy());
}

TEST_F(OperationsTest, ProgressKeepsTheCommandAtItsDevice) {
  Online();
  const auto order = MakeOrder("touch");
  Send(order);
  clock_.Advance(kSecond);
  const CommandId id = IdOf(order.id);
  operations_.OnOutcome("axis1", id, {.state = CommandState::kRunning, .text = "half", .progress = 0.5F});
  EXPECT_EQ(Answer(order).text, "half");
  EXPECT_TRUE(operations_.Busy());
  DeviceAnswers();
  EXPECT_EQ(Answer(order).state, Status::STATE_SUCCEEDED);
}

}  // namespace
}  // namespace axlecast
