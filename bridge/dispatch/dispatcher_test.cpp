#include "bridge/dispatch/dispatcher_fixture.h"
#include "core/command/commands.h"

namespace axlecast {
namespace {

TEST_F(DispatcherTest, RoutesAndBringsTheOutcomeBack) {
  EXPECT_EQ(Send(Body(1)).state, S::STATE_ROUTED);
  EXPECT_EQ(sink_.All<S>("COMMAND_STATUS")[0].state, S::STATE_ACCEPTED);
  EXPECT_EQ(Last().boot_id, kBoot);
  EXPECT_EQ(Last().driver_boot_id, kDriver);
  EXPECT_EQ(Last().is_unsigned, 1);
  EXPECT_EQ(Last().body_digest, BodyDigest(Encoded(Body(1))));
  ASSERT_EQ(Orders().size(), 1u);
  const auto order = Orders()[0];
  EXPECT_EQ(order.driver_boot_id, kDriver);
  EXPECT_EQ(order.operation, "bump");
  EXPECT_EQ(order.valid_ms, 1'000);
  Report(order, S::STATE_RUNNING);
  EXPECT_EQ(Last().state, S::STATE_RUNNING);
  Report(order, S::STATE_SUCCEEDED, {{"count", "1", "2"}});
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().is_final, 1);
  EXPECT_EQ(Last().changes[0].after, "2");
}

TEST_F(DispatcherTest, AnOvertakenStatusDoesNotTakeProgressBack) {
  Send(Body(1));
  const auto order = Orders()[0];
  const std::int64_t late = driver_seq_++;
  Report(order, S::STATE_RUNNING);
  driver_seq_ = late;
  Report(order, S::STATE_ROUTED);
  EXPECT_EQ(Last().state, S::STATE_RUNNING);
}

TEST_F(DispatcherTest, TheSameIdNeverActsTwice) {
  Send(Body(1));
  EXPECT_EQ(Send(Body(1)).state, S::STATE_ROUTED);
  Report(Orders()[0], S::STATE_SUCCEEDED);
  sink_.Clear();
  EXPECT_EQ(Send(Body(1)).state, S::STATE_SUCCEEDED);
  EXPECT_TRUE(Orders().empty());
}

// Validity counts on the bridge's monotonic clock: a captured command does not become valid again if UNIX time is set back.
TEST_F(DispatcherTest, AUnixClockThatStepsBackRevivesNoCommand) {
  const command_body_t never_sent = Body(1);
  const command_body_t done = Body(2);
  Send(done);
  Report(Orders()[0], S::STATE_SUCCEEDED);
  PassWithDriver(2 * kSecond);
  now_.utime -= 3'600'000'000;
  sink_.Clear();
  EXPECT_EQ(Send(never_sent).state, S::STATE_EXPIRED);
  EXPECT_EQ(Send(done).state, S::STATE_SUCCEEDED) << "as it ended";
  PassWithDriver(kSecond);
  EXPECT_TRUE(Orders().empty());
  EXPECT_EQ(Send(Body(3)).state, S::STATE_ROUTED) << "a new one acts";
}

TEST_F(DispatcherTest, AnotherBodyUnderTheSameIdIsRefusedAlone) {
  Send(Body(1));
  auto other = Body(1);
  other.device = "axis2";
  const S refused = Send(other);
  EXPECT_EQ(refused.reason_code, S::REASON_ID_REUSED);
  EXPECT_EQ(refused.body_digest, BodyDigest(Encoded(other)));
  Report(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
}

TEST_F(DispatcherTest, AQueryTellsTheBridgesBootId) {
  auto query = Body(1);
  query.bridge_boot_id = 0;
  const S answer = SendAs(query, command_body_t::MODE_QUERY);
  EXPECT_EQ(answer.state, S::STATE_UNKNOWN);
  EXPECT_EQ(answer.boot_id, kBoot);
  EXPECT_EQ(answer.body_digest, 0);
  Send(Body(1));
  EXPECT_EQ(SendAs(query, command_body_t::MODE_QUERY).state, S::STATE_ROUTED);
}

TEST_F(DispatcherTest, RefusesWhatItCannotTakeUp) {
  auto body = Body(1);
  body.bridge_boot_id = kBoot + 1;
  EXPECT_EQ(Send(body).reason_code, S::REASON_STALE_BRIDGE);
  body = Body(2);
  body.device = "axis9";
  EXPECT_EQ(Send(body).reason_code, S::REASON_UNKNOWN_DEVICE);
  EXPECT_EQ(Last().text, "no such device; devices of press3: axis1 axis2");
  EXPECT_EQ(Send(Body(3, "explode")).reason_code, S::REASON_UNKNOWN_OPERATION);
  EXPECT_EQ(Send(Body(3, "mark_reference_lost")).reason_code, S::REASON_UNKNOWN_OPERATION);
  EXPECT_EQ(Send(Body(4, "write")).reason_code, S::REASON_BAD_ARGUMENT);
  EXPECT_EQ(SendAs(Body(5), 9).reason_code, S::REASON_UNSUPPORTED_MODE);
  body = Body(6);
  body.valid_ms = 0;
  EXPECT_EQ(Send(body).reason_code, S::REASON_MALFORMED);
  body.valid_ms = 3'600'001;
  EXPECT_EQ(Send(body).reason_code, S::REASON_MALFORMED);
  EXPECT_EQ(SendAs(Body(7), -1).reason_code, S::REASON_UNSUPPORTED_MODE);
  body = Body(8);
  body.arguments = std::vector<argument_t>(17, {"note", "x"});
  body.n_arguments = 17;
  EXPECT_EQ(Send(body).text, "more than 16 arguments");
  EXPECT_EQ(Last().reason_code, S::REASON_MALFORMED);
  body = Body(9);
  body.reason = std::string(161, 'x');
  EXPECT_EQ(Send(body).text, "reason is longer than 160 bytes");
  EXPECT_EQ(Last().reason_code, S::REASON_MALFORMED);
  EXPECT_EQ(Last().is_final, 1);
  EXPECT_TRUE(Orders().empty());
}

class DispatcherSignedOnlyTest : public DispatcherTest {
 protected:
  DispatcherSignedOnlyTest() : DispatcherTest(false) {}
};

TEST_F(DispatcherSignedOnlyTest, RefusesUnsignedAndWhatItCannotVerify) {
  EXPECT_EQ(Send(Body(1)).reason_code, S::REASON_UNSIGNED);
  EXPECT_NE(Last().text.find("docs/keys.md"), std::string::npos);
  EXPECT_EQ(SendSigned(Body(1), SigningKey::Generate()).reason_code, S::REASON_BAD_SIGNATURE);
  auto query = Body(2);
  query.bridge_boot_id = 0;
  EXPECT_EQ(SendAs(query, command_body_t::MODE_QUERY).state, S::STATE_UNKNOWN);
  EXPECT_TRUE(Orders().empty());
}

TEST_F(DispatcherTest, OneAtATimePerDeviceInOrder) {
  Send(Body(1));
  Send(Body(2));
  EXPECT_EQ(Last().state, S::STATE_ACCEPTED);
  auto other = Body(3);
  other.device = "axis2";
  Send(other);
  ASSERT_EQ(Orders().size(), 2u);
  EXPECT_EQ(IdOf(Orders()[1].id), NumberedId(3));
  Report(Orders()[0], S::STATE_SUCCEEDED);
  ASSERT_EQ(Orders().size(), 3u);
  EXPECT_EQ(IdOf(Orders()[2].id), NumberedId(2));
}

TEST_F(DispatcherTest, AFullQueueRefusesAndStaysWithIt) {
  for (std::uint32_t i = 0; i <= DeviceQueue::kMaxWaiting; ++i) Send(Body(i));
  EXPECT_EQ(Send(Body(99)).reason_code, S::REASON_QUEUE_FULL);
  Report(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(Send(Body(99)).reason_code, S::REASON_QUEUE_FULL);
}

TEST_F(DispatcherTest, AnAbsentDriverIsSaidAtOnce) {
  Pass(DriverLink::kAbsentAfter + 10 * kMillisecond);
  EXPECT_EQ(Send(Body(1)).reason_code, S::REASON_DRIVER_ABSENT);
  Hello(kDriver);
  EXPECT_EQ(Send(Body(2)).state, S::STATE_ROUTED);
  Hello(kDriver, false, driver_status_t::KIND_GOODBYE);
  EXPECT_EQ(Send(Body(3)).reason_code, S::REASON_DRIVER_ABSENT);
}

TEST_F(DispatcherTest, RepeatsTheOrderUntilTheDriverAnswersThenAsks) {
  Send(Body(1));
  Pass(100 * kMillisecond);
  const auto orders = Orders();
  ASSERT_EQ(orders.size(), 6u);
  EXPECT_EQ(orders[5].kind, driver_order_t::KIND_EXECUTE);
  EXPECT_EQ(IdOf(orders[5].id), NumberedId(1));
  EXPECT_GT(orders[5].bridge_epoch, orders[4].bridge_epoch);
  EXPECT_EQ(orders[5].valid_ms, 900);
  Report(orders[5], S::STATE_RUNNING);
  sink_.Clear();
  Pass(250 * kMillisecond);
  ASSERT_EQ(Orders().size(), 1u);
  EXPECT_EQ(Orders()[0].kind, driver_order_t::KIND_QUERY);
}

TEST_F(DispatcherTest, ExpiresOnlyWhenTheDriverSaysThatItNeverSawIt) {
  Send(Body(1));
  PassWithDriver(1'100 * kMillisecond);
  const auto last = Orders().back();
  EXPECT_EQ(last.kind, driver_order_t::KIND_QUERY);
  auto earlier = last;
  earlier.bridge_epoch = Orders()[0].bridge_epoch - 1;  // an answer to something before
  Report(earlier, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().state, S::STATE_ROUTED);
  Report(last, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().state, S::STATE_EXPIRED);
  EXPECT_EQ(Last().reason_code, S::REASON_DEADLINE);
}

TEST_F(DispatcherTest, WhatWaitsTooLongExpires) {
  Send(Body(1));
  Report(Orders()[0], S::STATE_RUNNING);
  Send(Body(2));
  PassWithDriver(1'100 * kMillisecond);
  EXPECT_EQ(Last().state, S::STATE_EXPIRED);
  EXPECT_EQ(IdOf(Last().id), NumberedId(2));
}

TEST_F(DispatcherTest, CancelsWhatWaitsAndPassesTheRestOn) {
  Send(Body(1));
  Send(Body(2));
  EXPECT_EQ(SendAs(Body(2), command_body_t::MODE_CANCEL).state, S::STATE_CANCELLED);
  Report(Orders()[0], S::STATE_RUNNING);
  sink_.Clear();
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_CANCEL).state, S::STATE_RUNNING);
  EXPECT_EQ(Last().text, "the driver was asked to give it up if it has not begun");
  ASSERT_EQ(Orders().size(), 1u);
  EXPECT_EQ(Orders()[0].kind, driver_order_t::KIND_CANCEL);
  Report(Orders()[0], S::STATE_SUCCEEDED);  // it was too late
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_CANCEL).state, S::STATE_SUCCEEDED);
  EXPECT_EQ(SendAs(Body(9), command_body_t::MODE_CANCEL).state, S::STATE_UNKNOWN);
}

TEST_F(DispatcherTest, AnOldBootsMessagesDoNotBringItBack) {
  Hello(kDriver + 1);
  Hello(kDriver);  // late
  driver_boot_ = kDriver + 1;
  Send(Body(1));
  EXPECT_EQ(Last().driver_boot_id, kDriver + 1);
}

TEST_F(DispatcherTest, GivesALostReferenceBackToANewDriver) {
  Hello(kDriver, true);
  Hello(kDriver + 1, false);
  ASSERT_EQ(Orders().size(), 1u);
  EXPECT_EQ(Orders()[0].operation, "mark_reference_lost");
  EXPECT_EQ(Orders()[0].driver_boot_id, kDriver + 1);
  EXPECT_EQ(Statuses(), 0u);
  Report(Orders()[0], S::STATE_SUCCEEDED);
  Hello(kDriver + 1, true);
  Hello(kDriver + 1, false);  // an operation restored it
  Hello(kDriver + 2, false);
  EXPECT_EQ(Orders().size(), 1u);
}

TEST_F(DispatcherTest, ASecondBridgeStopsNewCommands) {
  S foreign{};
  foreign.boot_id = kBoot + 1;
  bridge_->OnCommandStatus(Encoded(foreign), now_);
  EXPECT_EQ(Send(Body(1)).reason_code, S::REASON_FENCED);
  PassWithDriver(DuplicateBridgeDetector::kForget + kSecond);
  EXPECT_EQ(Send(Body(2)).state, S::STATE_ROUTED);
  foreign.boot_id = kBoot;  // its own, looped back
  bridge_->OnCommandStatus(Encoded(foreign), now_);
  EXPECT_EQ(Send(Body(3)).state, S::STATE_ACCEPTED);
}

TEST_F(DispatcherTest, AsksForOtherBridgesBeforeItServes) {
  Timestamp now = now_;
  MemorySink sink;
  InlineJournal journal(store_);
  Dispatcher young(machine_, Origin{.boot_id = kBoot + 1},
                   {.journal = &journal, .commands = &sink, .data = &data_, .log = {}, .random = {}}, now);
  young.Tick(now);
  const auto questions = sink.All<command_t>("COMMAND");
  ASSERT_EQ(questions.size(), 1u);
  bridge_->OnCommand(Encoded(questions[0]), now);
  const S answer = Last();
  EXPECT_EQ(answer.boot_id, kBoot);
  young.OnCommandStatus(Encoded(answer), now);
  EXPECT_EQ(young.watch().Other(now.mono), kBoot);
  EXPECT_TRUE(young.watch().IsListening(now.mono));
}

TEST_F(DispatcherTest, BadBytesAreCounted) {
  bridge_->OnCommand({}, now_);
  bridge_->OnDriverStatus("DRIVER_STATUS/b0", {}, now_);
  bridge_->OnDriverStatus("DRIVER_STATUS/b9", {}, now_);
  EXPECT_EQ(bridge_->unauthorized(), 2);
  bridge_->OnCommandStatus({}, now_);
  EXPECT_EQ(bridge_->unauthorized(), 2) << "it is from nobody";
  EXPECT_EQ(bridge_->watch().Other(now_.mono), std::nullopt);
  driver_status_t other{};
  other.bus = "b9";
  other.boot_id = kDriver + 1;
  other.kind = driver_status_t::KIND_HELLO;
  bridge_->OnDriverStatus("DRIVER_STATUS/b0", Encoded(other), now_);
  EXPECT_EQ(bridge_->unauthorized(), 3) << "the status of another bus";
  EXPECT_EQ(Statuses(), 0u);
}

}  // namespace
}  // namespace axlecast
