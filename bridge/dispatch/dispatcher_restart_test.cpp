#include "bridge/dispatch/dispatcher_fixture.h"
#include "core/command/commands.h"

namespace axlecast {
namespace {

// What a bridge makes of commands that the one before it has left.

TEST_F(DispatcherTest, WhatWasNeverSentIsRejected) {
  Send(Body(1));
  Send(Body(2));  // waits
  RestartBridge(kBoot + 1);
  const auto known = store_.Find(NumberedId(2));
  ASSERT_TRUE(known);
  EXPECT_EQ(known->state, S::STATE_REJECTED);
  EXPECT_EQ(known->reason_code, S::REASON_BRIDGE_RESTARTED);
  EXPECT_EQ(known->is_final, 1);
}

TEST_F(DispatcherTest, OfWhatWasSentTheDriverIsAskedAndItsWordIsTheOutcome) {
  Send(Body(1));
  const auto first = Orders()[0];
  RestartBridge(kBoot + 1);
  ASSERT_FALSE(Orders().empty());
  const auto question = Orders().back();
  EXPECT_EQ(question.kind, driver_order_t::KIND_QUERY);
  EXPECT_EQ(IdOf(question.id), NumberedId(1));
  EXPECT_EQ(question.driver_boot_id, kDriver);
  EXPECT_GT(question.bridge_epoch, first.bridge_epoch);
  Hello(kDriver);
  Report(question, S::STATE_SUCCEEDED, {{"count", "1", "2"}});
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().boot_id, kBoot + 1);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_SUCCEEDED);
}

TEST_F(DispatcherTest, WhatTheDriverNeverHadIsRejectedOnItsPromiseToThisBridgeOnly) {
  Send(Body(1));
  auto late = Orders()[0];
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  Report(late, S::STATE_UNKNOWN);  // an answer to the bridge before: its order may still be under way
  EXPECT_FALSE(store_.Find(NumberedId(1))->is_final);
  Report(Orders().back(), S::STATE_UNKNOWN);
  EXPECT_EQ(Last().state, S::STATE_REJECTED);
  EXPECT_EQ(Last().reason_code, S::REASON_BRIDGE_RESTARTED);
}

// The first question of this bridge is later than every order of the bridge before.
TEST_F(DispatcherTest, TheAnswerToTheFirstQuestionOfThisBridgeIsSufficient) {
  Send(Body(1));
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  driver_order_t before = Orders().front();
  --before.bridge_epoch;
  Report(before, S::STATE_UNKNOWN);
  EXPECT_FALSE(store_.Find(NumberedId(1))->is_final);
  Report(Orders().front(), S::STATE_UNKNOWN);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_REJECTED);
}

TEST_F(DispatcherTest, ACommandOfTheBridgeBeforeIsAnsweredWithItsLastState) {
  Send(Body(1));
  RestartBridge(kBoot + 1);
  const S answer = SendAs(Body(1), command_body_t::MODE_QUERY);
  EXPECT_EQ(answer.state, S::STATE_ROUTED);
  EXPECT_EQ(answer.reason_code, S::REASON_NONE);
}

TEST_F(DispatcherTest, AnUndoOfTheBridgeBeforeTakesTheDatumBack) {
  ASSERT_TRUE(store_.Apply("axis1", DatumRecord{.counts = 5, .utime = 1}));
  RestartBridge(kBoot);
  Hello(kDriver);
  Send(Body(1, "undo_datum"));
  ASSERT_EQ(Orders().back().operation, "clear_datum");
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_SUCCEEDED);
  EXPECT_FALSE(store_.Find("axis1").datum);
}

// As after a change of the machine's file: the bridge before waited for a check that this bridge cannot make.
TEST_F(DispatcherTest, AnOpenFindingThatNothingCanMakeIsConcludedAtOnce) {
  CommandRecord record;
  const CommandId id = NumberedId(1);
  std::copy(id.begin(), id.end(), std::begin(record.status.id));
  record.status.device = "axis1";
  record.status.operation = "write";
  record.status.driver_boot_id = kDriver;
  record.status.state = S::STATE_INDETERMINATE;
  record.status.reason_code = S::REASON_DRIVER_RESTARTED;
  record.status.is_final = 1;
  ASSERT_TRUE(store_.Accepted(record, now_));
  RestartBridge(kBoot + 1);
  EXPECT_EQ(store_.Find(id)->finding, S::FINDING_CANNOT_TELL);
  Hello(kDriver);
  EXPECT_TRUE(Orders().empty());
}

TEST_F(DispatcherTest, WhenTheDriverIsAnotherTooItIsIndeterminateThenFound) {
  Send(Body(1));
  RestartBridge(kBoot + 1);
  Hello(kDriver + 1);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Orders().back().operation, "look");
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"finding", "", "reads_as_after"}});
  EXPECT_EQ(Last().finding, S::FINDING_EFFECT_SEEN);
}

TEST_F(DispatcherTest, AFindingThatWasNotMadeIsMadeByTheNextBridge) {
  Send(Body(1));
  Hello(kDriver + 1);
  EXPECT_EQ(Last().finding, S::FINDING_NONE);
  RestartBridge(kBoot + 1);
  Hello(kDriver + 1);
  ASSERT_FALSE(Orders().empty());
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"finding", "", "no_effect_seen"}});
  EXPECT_EQ(Last().finding, S::FINDING_NO_EFFECT_SEEN);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_INDETERMINATE);
}

TEST_F(DispatcherTest, ADriverThatIsNeverHeardAgainIsSaid) {
  Send(Body(1));
  RestartBridge(kBoot + 1);
  Pass(DeviceQueue::kSilentAfter + kSecond);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_INDETERMINATE);
  EXPECT_EQ(store_.Find(NumberedId(1))->reason_code, S::REASON_DRIVER_SILENT);
}

TEST_F(DispatcherTest, ACommandForTheBridgeBeforeIsAnsweredButNotDone) {
  const auto body = Body(1);
  Send(body);
  Report(Orders()[0], S::STATE_SUCCEEDED);
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  EXPECT_EQ(Send(body).state, S::STATE_SUCCEEDED);  // for ever
  EXPECT_EQ(Send(Body(2)).reason_code, S::REASON_STALE_BRIDGE);
}

TEST_F(DispatcherTest, WhoAsksForACommandOfTheBridgeBeforeIsAnsweredFromTheJournal) {
  Send(Body(1));
  Report(Orders()[0], S::STATE_SUCCEEDED);
  RestartBridge(kBoot + 1);
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_QUERY).state, S::STATE_SUCCEEDED);
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_CANCEL).state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().text, "");
  auto other = Body(1);
  other.reason = "another body";
  EXPECT_EQ(Send(other).reason_code, S::REASON_ID_REUSED);
}

TEST_F(DispatcherTest, ACancellationForADeviceThatDoesNotExistIsAnsweredWithTheReason) {
  Send(Body(1));
  auto cancel = Body(1);
  cancel.device = "axis9";
  const S answer = SendAs(cancel, command_body_t::MODE_CANCEL);
  EXPECT_EQ(answer.state, S::STATE_ROUTED) << "it continues";
  EXPECT_EQ(answer.text, "no such device; devices of press3: axis1 axis2");
}

// As after a change of the machine's file.
TEST_F(DispatcherTest, WhatTheBridgeBeforeSentToADeviceThatIsNoMoreIsIndeterminate) {
  for (const bool device_is_gone : {true, false}) {
    const CommandId id = NumberedId(device_is_gone ? 1 : 2);
    CommandRecord record;
    std::copy(id.begin(), id.end(), std::begin(record.status.id));
    record.status.device = device_is_gone ? "axis9" : "axis1";
    record.status.operation = device_is_gone ? "bump" : "explode";
    record.status.driver_boot_id = kDriver;
    record.status.state = S::STATE_ROUTED;
    ASSERT_TRUE(store_.Accepted(record, now_));
    RestartBridge(kBoot + 1);
    const auto known = store_.Find(id);
    ASSERT_TRUE(known);
    EXPECT_EQ(known->state, S::STATE_INDETERMINATE);
    EXPECT_EQ(known->finding, S::FINDING_CANNOT_TELL);
    EXPECT_NE(known->text.find("has this device or operation no more"), std::string::npos);
  }
}

TEST_F(DispatcherTest, ACommandThatThisBridgeHasTakenUpAlreadyIsNotRecovered) {
  Send(Body(1, "halt"));
  bridge_.reset();
  bridge_ = MakeBridge(kBoot + 1, true);
  Pass(DuplicateBridgeDetector::kListen);
  Hello(kDriver);
  sink_.Clear();
  auto again = Body(1, "halt");
  again.bridge_boot_id = kBoot + 1;
  EXPECT_EQ(Send(again).state, S::STATE_ROUTED) << "urgent commands do not wait for the journal";
  journal_->Recover();
  Step(10 * kMillisecond);
  ASSERT_EQ(Orders().size(), 1U);
  EXPECT_EQ(Orders()[0].kind, driver_order_t::KIND_EXECUTE);
  Report(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
}

TEST_F(DispatcherTest, ADriverIsGivenBackOneThingAtATime) {
  Hello(kDriver, true);
  Hello(kDriver + 1, false);
  ASSERT_EQ(Orders().size(), 1U);
  EXPECT_EQ(Orders()[0].operation, "mark_reference_lost");
  Hello(kDriver + 1, false);
  Report(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(Orders().size(), 1U) << "the second HELLO came before the driver had it";
}

TEST_F(DispatcherTest, AJournalThatOpensLateTakesNothingFromAReadThatIsUnderWay) {
  Send(Body(1));
  store_.fails = true;
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  sink_.Clear();
  auto read = Body(2, "look");
  read.bridge_boot_id = kBoot + 1;
  EXPECT_EQ(Send(read).state, S::STATE_ROUTED);
  const auto order = Orders().back();
  store_.fails = false;
  Step(10 * kMillisecond);
  Report(order, S::STATE_SUCCEEDED);
  EXPECT_EQ(IdOf(Last().id), NumberedId(2));
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(IdOf(Orders().back().id), NumberedId(1)) << "then the driver is asked for what the first bridge left";
  EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_QUERY);
}

TEST_F(DispatcherTest, ACommandOfTheBridgeBeforeThatWaitsIsCancelledByItsDriverOnly) {
  Send(Body(1));  // its driver has it, and may have executed it
  store_.fails = true;
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  auto read = Body(2, "look");
  read.bridge_boot_id = kBoot + 1;
  Send(read);
  const auto look = Orders().back();
  store_.fails = false;
  Step(10 * kMillisecond);  // now it waits behind the read
  SendAs(Body(1), command_body_t::MODE_CANCEL);
  EXPECT_EQ(store_.Find(NumberedId(1))->is_final, 0);
  Report(look, S::STATE_SUCCEEDED);
  const auto asked = Orders().back();
  EXPECT_EQ(IdOf(asked.id), NumberedId(1));
  EXPECT_EQ(asked.kind, driver_order_t::KIND_CANCEL);
  Report(asked, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_SUCCEEDED);
}

// -- the journal

TEST_F(DispatcherTest, WithoutAJournalNothingIsChangedButReadsAndStopsPass) {
  store_.fails = true;
  EXPECT_EQ(Send(Body(1)).reason_code, S::REASON_JOURNAL);
  EXPECT_NE(Last().text.find("the disk is full"), std::string::npos);
  EXPECT_TRUE(Orders().empty());
  EXPECT_EQ(Send(Body(2, "look")).state, S::STATE_ROUTED);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(Send(Body(3, "halt")).state, S::STATE_ROUTED);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(SendAs(Body(3, "halt"), command_body_t::MODE_QUERY).state, S::STATE_SUCCEEDED);
  store_.fails = false;
  EXPECT_EQ(Send(Body(1)).reason_code, S::REASON_JOURNAL) << "what was refused stays refused";
  EXPECT_EQ(Send(Body(4)).state, S::STATE_ROUTED);
}

TEST_F(DispatcherTest, AJournalThatFailsBetweenAcceptanceAndSendingLetsNothingGo) {
  Send(Body(1));
  Send(Body(2));
  store_.fails = true;
  sink_.Clear();
  Report(OrderMessage(kDriver, 1, NumberedId(1), "axis1", "bump"), S::STATE_SUCCEEDED);
  EXPECT_TRUE(Orders().empty());
  EXPECT_EQ(Last().reason_code, S::REASON_JOURNAL);
  EXPECT_EQ(IdOf(Last().id), NumberedId(2));
}

TEST_F(DispatcherTest, ReadsLeaveNoTraceInTheJournal) {
  Send(Body(1, "look"));
  EXPECT_FALSE(store_.Find(NumberedId(1)));
  Report(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(SendAs(Body(1, "look"), command_body_t::MODE_QUERY).state, S::STATE_SUCCEEDED);
}

// -- validity

TEST_F(DispatcherTest, ACommandThatCameTooLateExpires) {
  auto body = Body(1);
  body.issued_mono_ns = now_.mono - kSecond;
  EXPECT_EQ(Send(body).state, S::STATE_EXPIRED);
  EXPECT_TRUE(Orders().empty());
  body = Body(2);
  body.issued_mono_ns = now_.mono + 2 * kSecond;
  EXPECT_EQ(Send(body).reason_code, S::REASON_MALFORMED);
  EXPECT_TRUE(Orders().empty());
}

// -- two steps

TEST_F(DispatcherTest, WhatIsPreparedIsShownAndThenCommittedOnce) {
  S shown = SendAs(Body(1), command_body_t::MODE_PREPARE);
  ASSERT_EQ(Orders().size(), 1u);
  EXPECT_EQ(Orders()[0].kind, driver_order_t::KIND_PREPARE);
  Report(Orders()[0], S::STATE_SUCCEEDED, {{"count", "1", "2"}});
  shown = Last();
  EXPECT_EQ(shown.state, S::STATE_SUCCEEDED);
  EXPECT_EQ(shown.changes[0].after, "2");
  EXPECT_FALSE(store_.Find(NumberedId(1))) << "nothing was done";

  auto commit = Body(2);
  std::copy(std::begin(shown.token), std::end(shown.token), std::begin(commit.token));
  EXPECT_EQ(SendAs(commit, command_body_t::MODE_COMMIT).state, S::STATE_ROUTED);
  EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_EXECUTE);
  EXPECT_EQ(Orders().back().expect_epoch, 3) << "bound to what was shown";
  Report(Orders().back(), S::STATE_SUCCEEDED);
  const CommandId id = NumberedId(3);
  std::copy(id.begin(), id.end(), std::begin(commit.id));
  EXPECT_EQ(SendAs(commit, command_body_t::MODE_COMMIT).reason_code, S::REASON_TOKEN) << "a token is good once";
}

TEST_F(DispatcherTest, ATokenIsForThatOperationOnThatDeviceForAShortTime) {
  const auto prepared = [&](std::uint32_t number) {
    SendAs(Body(number), command_body_t::MODE_PREPARE);
    Report(Orders().back(), S::STATE_SUCCEEDED);
    auto commit = Body(number + 100);
    const S shown = Last();
    std::copy(std::begin(shown.token), std::end(shown.token), std::begin(commit.token));
    return commit;
  };
  auto commit = prepared(1);
  commit.device = "axis2";
  EXPECT_EQ(SendAs(commit, command_body_t::MODE_COMMIT).reason_code, S::REASON_TOKEN);
  commit = prepared(2);
  commit.token[3] = static_cast<std::uint8_t>(commit.token[3] ^ 1);
  EXPECT_EQ(SendAs(commit, command_body_t::MODE_COMMIT).reason_code, S::REASON_TOKEN);
  commit = prepared(3);
  PassWithDriver(PreparedCommands::kValid + kSecond);
  commit.issued_mono_ns = now_.mono;
  EXPECT_EQ(SendAs(commit, command_body_t::MODE_COMMIT).reason_code, S::REASON_TOKEN);
  EXPECT_NE(Last().text.find("30 s"), std::string::npos);
}

TEST_F(DispatcherTest, WhatWouldBeRefusedGivesNoToken) {
  SendAs(Body(1), command_body_t::MODE_PREPARE);
  Report(Orders()[0], S::STATE_REJECTED);
  EXPECT_EQ(Last().state, S::STATE_REJECTED);
  EXPECT_EQ(IdOf(Last().token), CommandId{});
}

// -- devices whose memory wears, and whose zero moves

std::int32_t TwoWrites(const Arguments& /*arguments*/) { return 2; }

MachineConfig WearingMachine() {
  static const std::vector<OperationSpec> kOperations = {
      {.name = "engrave", .help = "writes the device's memory", .destructive = true, .writes = &TwoWrites},
      {.name = "move_zero", .help = "moves the device's zero", .destructive = true, .moves_datum = true}};
  static const Family kFamily = {.name = "wearing", .summary = "for tests", .operations = kOperations};
  const auto settings = std::make_shared<DeviceSettings>();
  settings->counts_per_turn = 1'000;
  settings->write_budget = 3;
  MachineConfig machine = TestMachine(true);
  machine.buses[0].family = &kFamily;
  machine.buses[0].devices[0].settings = settings;
  return machine;
}

class WearingDeviceTest : public DispatcherTest {
 protected:
  WearingDeviceTest() : DispatcherTest(WearingMachine(), {}) {}
  // The driver is silent after the order, until it is received again: it is asked for the outcome then.
  void FallSilent() {
    Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
    sink_.Clear();
    Hello(kDriver);
    ASSERT_EQ(Orders().size(), 1U);
    ASSERT_EQ(Orders()[0].kind, driver_order_t::KIND_QUERY);
  }
  void MoveZeroOfADatum() {
    ASSERT_TRUE(store_.Apply("axis1", DatumRecord{.counts = 5, .utime = 1}));
    RestartBridge(kBoot);
    Hello(kDriver);
    Send(Body(1, "move_zero"));
    ASSERT_FALSE(store_.Find("axis1").datum) << "it is void as soon as the order is sent";
  }
};

TEST_F(WearingDeviceTest, AWornMemoryIsNotWritten) {
  Send(Body(1, "engrave"));
  Report(Orders().back(), S::STATE_SUCCEEDED, {}, 2);
  EXPECT_EQ(store_.Find("axis1").writes, 2);
  sink_.Clear();
  EXPECT_EQ(Send(Body(2, "engrave")).reason_code, S::REASON_WEAR);
  EXPECT_TRUE(Orders().empty());
}

TEST_F(WearingDeviceTest, WritesThatTheDriverDidNotMakeAreNotCountedAlsoAfterARestart) {
  Send(Body(1, "engrave"));
  EXPECT_EQ(store_.Find("axis1").writes, 2) << "at most";
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  Report(Orders().back(), S::STATE_FAILED, {}, 1);
  EXPECT_EQ(store_.Find("axis1").writes, 1);
}

TEST_F(WearingDeviceTest, ADatumHoldsAgainIfASilentDriverReportsThatItDidNothing) {
  MoveZeroOfADatum();
  FallSilent();
  Report(Orders()[0], S::STATE_REJECTED);
  EXPECT_EQ(Last().finding, S::FINDING_NO_EFFECT_SEEN);
  EXPECT_TRUE(store_.Find("axis1").datum);
}

TEST_F(WearingDeviceTest, ADatumStaysVoidIfASilentDriverNeverReports) {
  MoveZeroOfADatum();
  FallSilent();
  PassWithDriver(Dispatcher::kCheckWithin + kSecond);
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
  EXPECT_FALSE(store_.Find("axis1").datum);
}

}  // namespace
}  // namespace axlecast
