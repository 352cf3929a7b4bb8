// What the bridge publishes, and what its orders contain.
#include <gmock/gmock.h>

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <set>

#include "bridge/dispatch/dispatcher_fixture.h"

namespace axlecast {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class DispatcherMessagesTest : public DispatcherTest {
 protected:
  std::vector<alarm_t> Alarms() const { return data_.All<alarm_t>("ALARM/bridge"); }
  std::set<std::string> Active() const {
    std::set<std::string> names;
    const std::vector<alarm_t> alarms = Alarms();
    if (alarms.empty()) return names;
    for (const alarm_entry_t& entry : alarms.back().entries) {
      if (entry.state == alarm_entry_t::STATE_LIVE) names.insert(entry.name);
    }
    return names;
  }
  // Time until ALARM/bridge is published.
  MonoNs UntilAlarms() {
    data_.Clear();
    const MonoNs begin = now_.mono;
    while (Alarms().empty() && now_.mono - begin < 10 * kSecond) Step(10 * kMillisecond);
    return now_.mono - begin;
  }
  void OtherBridge() {
    S status{};
    status.boot_id = kBoot + 1;
    bridge_->OnCommandStatus(Encoded(status), now_);
  }
  std::vector<driver_command_t> Commands() const { return sink_.All<driver_command_t>("DRIVER_COMMAND/b0"); }
};

// ---- alarms ----

TEST_F(DispatcherMessagesTest, ItsAlarmsComeOnceASecondAndWithin100MsOfAChange) {
  static_cast<void>(UntilAlarms());
  EXPECT_EQ(UntilAlarms(), kSecond);
  EXPECT_EQ(UntilAlarms(), kSecond);
  OtherBridge();
  EXPECT_EQ(UntilAlarms(), 100 * kMillisecond);
  EXPECT_EQ(UntilAlarms(), kSecond) << "the change is published once";
}

TEST_F(DispatcherMessagesTest, AnotherBridgeIsAnAlarmUntilItIsSilent) {
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Not(Contains("other_bridge")));
  OtherBridge();
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Contains("other_bridge"));
  PassWithDriver(DuplicateBridgeDetector::kForget + 2 * kSecond);
  EXPECT_THAT(Active(), Not(Contains("other_bridge")));
}

TEST_F(DispatcherMessagesTest, AJournalThatFailsIsAnAlarm) {
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Not(Contains("journal_fails")));
  journal_->Stall();
  Pass(JournalQueue::kStalled + 2 * kSecond);
  EXPECT_THAT(Active(), Contains("journal_fails"));
  journal_->Recover();
  Pass(2 * kSecond);
  EXPECT_THAT(Active(), Not(Contains("journal_fails")));
}

TEST_F(DispatcherMessagesTest, UnsignedCommandsThatAreAllowedAreAnAlarm) {
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Contains("unsigned_allowed"));
  EXPECT_THAT(Active(), Not(Contains("key_missing")));
}

TEST_F(DispatcherMessagesTest, UnauthorizedMessagesAreAnAlarm) {
  bridge_->OnCommand(std::vector<std::uint8_t>{1, 2, 3}, now_);
  Pass(2 * kSecond);
  EXPECT_THAT(Active(), Contains("foreign_commands"));
}

class DispatcherWithoutItsKeyTest : public DispatcherMessagesTest {
 protected:
  DispatcherWithoutItsKeyTest() {
    machine_.bridge.bridge.public_key = PublicKey{};
    machine_.bridge.allow_unsigned = false;
    bridge_.reset();
    bridge_ = MakeBridge(kBoot);
  }
};

TEST_F(DispatcherWithoutItsKeyTest, AKeyThatTheMachineNamesAndTheBridgeHasNotIsAnAlarm) {
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Contains("key_missing"));
  EXPECT_THAT(Active(), Not(Contains("unsigned_allowed")));
}

class DispatcherDeviceAlarmsTest : public DispatcherMessagesTest {
 protected:
  // HELLO of an axis that answers with this identity, at this position.
  void Seen(std::int64_t boot_id, const std::string& identity, std::int64_t position) {
    driver_device_t axis = OnlineDevice("axis1");
    axis.identity = identity;
    axis.has_position = 1;
    axis.position = position;
    axis.position_utime = now_.utime;
    HelloWith(boot_id, axis);
  }
  static MachineConfig WithTurns() {
    const auto settings = std::make_shared<DeviceSettings>();
    settings->counts_per_turn = 1'000;
    settings->turns_range = 100;
    MachineConfig machine = TestMachine(true);
    machine.buses[0].devices[0].settings = settings;
    return machine;
  }
};

TEST_F(DispatcherDeviceAlarmsTest, AnotherEncoderIsAnAlarm) {
  Seen(kDriver, "17 A", 100);
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Not(Contains("encoder_exchanged")));
  Seen(kDriver + 1, "17 B", 100);
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Contains("encoder_exchanged"));
}

TEST_F(DispatcherDeviceAlarmsTest, AShaftThatMovedFarWithoutItsDriverIsAnAlarm) {
  machine_ = WithTurns();
  RestartBridge(kBoot);
  Seen(kDriver, "", 0);
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Not(Contains("place_doubtful")));
  Seen(kDriver + 1, "", 40'000);
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Contains("place_doubtful"));
}

TEST_F(DispatcherDeviceAlarmsTest, TheLastPositionIsStored) {
  Seen(kDriver, "17 A", 4'321);
  Step(10 * kMillisecond);
  const auto position = store_.Find("axis1").position;
  ASSERT_TRUE(position);
  EXPECT_EQ(position->counts, 4'321);
}

// The bridge cannot compare before it has read what the earlier bridge stored.
TEST_F(DispatcherDeviceAlarmsTest, AnotherEncoderIsNoticedAlthoughTheJournalIsReadLate) {
  Seen(kDriver, "17 A", 100);
  Step(10 * kMillisecond);
  store_.fails = true;
  RestartBridge(kBoot + 1);
  Seen(kDriver + 1, "17 B", 100);
  Step(10 * kMillisecond);
  store_.fails = false;
  Step(10 * kMillisecond);
  Step(10 * kMillisecond);
  Seen(kDriver + 1, "17 B", 100);
  static_cast<void>(UntilAlarms());
  EXPECT_THAT(Active(), Contains("encoder_exchanged"));
}

// ---- headers, ids and epochs ----

TEST_F(DispatcherMessagesTest, TheQuestionsForOtherBridgesAreNumberedAndHaveTheBootOfTheBridge) {
  RestartBridge(kBoot + 1);
  const auto questions = sink_.All<command_t>("COMMAND");
  ASSERT_THAT(questions, SizeIs(3));
  for (std::size_t i = 0; i < questions.size(); ++i) {
    EXPECT_EQ(questions[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(questions[i].boot_id, kBoot + 1);
    EXPECT_GT(questions[i].mono_ns, 0);
  }
}

TEST_F(DispatcherMessagesTest, ABridgeServesNobodyBeforeItHasAskedForOthers) {
  bridge_.reset();
  bridge_ = MakeBridge(kBoot + 1);
  sink_.Clear();
  SendAs(Body(1), command_body_t::MODE_QUERY);
  EXPECT_EQ(Statuses(), 0U);
  Pass(DuplicateBridgeDetector::kListen);
  SendAs(Body(1), command_body_t::MODE_QUERY);
  EXPECT_EQ(Statuses(), 1U);
}

TEST_F(DispatcherMessagesTest, AStatusHasNoEpochBeforeTheOutcomeAndTheTimeOfItsRefusal) {
  EXPECT_EQ(Send(Body(1)).epoch_after, -1);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().epoch_after, 3);
  const S refused = Send(Body(2, "explode"));
  EXPECT_EQ(refused.state, S::STATE_REJECTED);
  EXPECT_EQ(refused.finished_utime, now_.utime);
  EXPECT_EQ(refused.epoch_after, -1);
}

TEST_F(DispatcherMessagesTest, AStatusHasTheTimeOfTheMessageThatItFollows) {
  Send(Body(1));
  now_.mono += 5 * kMillisecond;
  now_.utime += 5'000;
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().mono_ns, now_.mono);
  EXPECT_EQ(Last().utime, now_.utime);
}

TEST_F(DispatcherMessagesTest, EachMessageHasItsTimeAndTheNumbersOfItsChannel) {
  Send(Body(1));
  Step(10 * kMillisecond);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  const auto statuses = sink_.All<S>("COMMAND_STATUS");
  ASSERT_GE(statuses.size(), 3U);
  for (std::size_t i = 0; i < statuses.size(); ++i) {
    EXPECT_EQ(statuses[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(statuses[i].boot_id, kBoot);
  }
  EXPECT_EQ(statuses.back().utime, now_.utime);
  EXPECT_EQ(statuses.back().mono_ns, now_.mono);
  ASSERT_THAT(Commands(), SizeIs(1));
  EXPECT_EQ(Commands()[0].seq, 0);
  EXPECT_EQ(Commands()[0].boot_id, kBoot);
  EXPECT_EQ(Commands()[0].mono_ns, now_.mono - 10 * kMillisecond);
}

TEST_F(DispatcherMessagesTest, AnOrderNamesBridgeDriverDeviceAndOperation) {
  auto body = Body(1, "write");
  body.arguments = {{"address", "3"}, {"bytes", "A1"}};
  body.n_arguments = 2;
  body.expect_epoch = 5;
  Send(body);
  const driver_order_t order = Orders().back();
  EXPECT_EQ(order.bridge_boot_id, kBoot);
  EXPECT_EQ(order.driver_boot_id, kDriver);
  EXPECT_EQ(order.device, "axis1");
  EXPECT_EQ(order.operation, "write");
  EXPECT_EQ(order.expect_epoch, 5);
  ASSERT_THAT(order.arguments, SizeIs(2));
  EXPECT_EQ(order.arguments[1].value, "A1");
  PassWithDriver(20 * kMillisecond);
  Report(order, S::STATE_RUNNING);
  sink_.Clear();
  PassWithDriver(300 * kMillisecond);
  ASSERT_THAT(Orders(), Not(IsEmpty()));
  EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_QUERY);
  EXPECT_THAT(Orders().back().arguments, IsEmpty()) << "a question carries none";
}

TEST_F(DispatcherMessagesTest, APreparedOrderCarriesItsArguments) {
  auto body = Body(1, "write");
  body.arguments = {{"address", "3"}, {"bytes", "A1"}};
  body.n_arguments = 2;
  SendAs(body, command_body_t::MODE_PREPARE);
  ASSERT_THAT(Orders(), Not(IsEmpty()));
  EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_PREPARE);
  EXPECT_THAT(Orders().back().arguments, SizeIs(2));
}

TEST_F(DispatcherMessagesTest, ACommitExpectsTheEpochThatWasPreparedUnlessItNamesOne) {
  for (const std::int32_t own : {-1, 0}) {
    const auto number = static_cast<std::uint32_t>(10 + own * 5);
    SendAs(Body(number), command_body_t::MODE_PREPARE);
    Report(Orders().back(), S::STATE_SUCCEEDED);
    auto commit = Body(number + 1);
    commit.mode = command_body_t::MODE_COMMIT;
    const S prepared = Last();
    std::copy(std::begin(prepared.token), std::end(prepared.token), std::begin(commit.token));
    commit.expect_epoch = own;
    Send(commit);
    EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_EXECUTE);
    EXPECT_EQ(Orders().back().expect_epoch, own < 0 ? 3 : 0);
    Report(Orders().back(), S::STATE_SUCCEEDED);
  }
}

TEST_F(DispatcherMessagesTest, EpochsRiseAboveWhatAnEarlierBridgeAndEachDriverHad) {
  Send(Body(1));
  Report(Orders().back(), S::STATE_SUCCEEDED);
  const std::int64_t earlier = Orders().back().bridge_epoch;
  now_.utime -= std::int64_t{3'600} * 1'000'000;  // the clock was set back
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  auto body = Body(2);
  body.bridge_boot_id = kBoot + 1;
  Send(body);
  ASSERT_THAT(Orders(), Not(IsEmpty()));
  EXPECT_GT(Orders().back().bridge_epoch, earlier);
  driver_status_t hello{};
  hello.kind = driver_status_t::KIND_HELLO;
  hello.bridge_epoch = std::int64_t{1} << 60;
  FromDriver(hello);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  body = Body(3);
  body.bridge_boot_id = kBoot + 1;
  Send(body);
  EXPECT_GT(Orders().back().bridge_epoch, hello.bridge_epoch);
}

// The orders of the bridge itself: its boot id and a number, so that no two are equal.
TEST_F(DispatcherMessagesTest, AnOrderOfTheBridgeItselfHasAnIdOfItsBootAndANumber) {
  constexpr std::int64_t kOwnBoot = 0x0102'0304'0506'0708;
  RestartBridge(kOwnBoot);
  Hello(kDriver);
  std::vector<CommandId> ids;
  for (std::uint32_t number = 1; number <= 258; ++number) {
    auto body = Body(number);
    body.bridge_boot_id = kOwnBoot;
    Send(body);
    sink_.Clear();
    Hello(kDriver + static_cast<std::int64_t>(number));  // the outcome is read from the device then
    Step(10 * kMillisecond);
    ASSERT_THAT(Orders(), Not(IsEmpty()));
    EXPECT_EQ(Orders().back().operation, "look");
    ids.push_back(IdOf(Orders().back().id));
    Report(Orders().back(), S::STATE_SUCCEEDED);
  }
  EXPECT_EQ(ids[0], (CommandId{8, 7, 6, 5, 4, 3, 2, 1, 1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(ids[1], (CommandId{8, 7, 6, 5, 4, 3, 2, 1, 2, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(ids[257], (CommandId{8, 7, 6, 5, 4, 3, 2, 1, 2, 1, 0, 0, 0, 0, 0, 0}));
}

// ---- what is stored ----

TEST_F(DispatcherMessagesTest, EachStepIsStoredAndAnswered) {
  Send(Body(1));
  Report(Orders().back(), S::STATE_RUNNING);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_RUNNING);
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_QUERY).state, S::STATE_RUNNING);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_SUCCEEDED);
}

TEST_F(DispatcherMessagesTest, EachStepBehindTheRoutingIsStoredOnceAndNoneOfARead) {
  Send(Body(1));
  EXPECT_EQ(store_.steps, 0) << "its routing is stored as such";
  Report(Orders().back(), S::STATE_RUNNING);
  EXPECT_EQ(store_.steps, 1);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  Send(Body(2, "look"));
  Report(Orders().back(), S::STATE_RUNNING);
  EXPECT_EQ(store_.steps, 1);
  EXPECT_EQ(SendAs(Body(2, "look"), command_body_t::MODE_QUERY).state, S::STATE_RUNNING);
}

TEST_F(DispatcherMessagesTest, AnUrgentCommandIsStoredAsRoutedToo) {
  Send(Body(1, "halt"));
  ASSERT_TRUE(store_.Find(NumberedId(1)));
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_ROUTED);
}

TEST_F(DispatcherMessagesTest, ARefusalIsStored) {
  Hello(kDriver, false, driver_status_t::KIND_GOODBYE);
  EXPECT_EQ(Send(Body(1)).reason_code, S::REASON_DRIVER_ABSENT);
  ASSERT_TRUE(store_.Find(NumberedId(1)));
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_REJECTED);
  EXPECT_EQ(store_.Find(NumberedId(1))->reason_code, S::REASON_DRIVER_ABSENT);
}

TEST_F(DispatcherMessagesTest, WhatTheDiskCannotTakeIsRefusedOnceWithItsFirstReason) {
  store_.fails = true;
  EXPECT_EQ(Send(Body(1)).reason_code, S::REASON_JOURNAL);
  EXPECT_EQ(Statuses(), 1U);
  PassWithDriver(100 * kMillisecond);
  EXPECT_EQ(Statuses(), 1U);
  EXPECT_THAT(Orders(), IsEmpty());
  Hello(kDriver, false, driver_status_t::KIND_GOODBYE);
  EXPECT_EQ(Send(Body(2)).reason_code, S::REASON_DRIVER_ABSENT);
}

TEST_F(DispatcherMessagesTest, ADatumThatWasSetIsStoredWithWhoSetIt) {
  auto body = Body(1, "set_datum");
  body.arguments = {{"counts", "73"}, {"utime", "5000"}};
  body.n_arguments = 2;
  body.reason = "homed";
  Send(body);
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"datum_counts", "", "73"}});
  const auto datum = store_.Find("axis1").datum;
  ASSERT_TRUE(datum);
  EXPECT_EQ(datum->counts, 73);
  EXPECT_EQ(datum->utime, 5'000);
  EXPECT_EQ(datum->who, "unsigned");
  EXPECT_EQ(datum->reason, "homed");
}

TEST_F(DispatcherMessagesTest, ADatumThatADriverIsGivenBackIsAnEvent) {
  ASSERT_TRUE(store_.Apply("axis1", DatumRecord{.counts = 5, .utime = 5'000}));
  RestartBridge(kBoot);
  driver_device_t axis = OnlineDevice("axis1");
  axis.has_position = 1;
  HelloWith(kDriver, axis);
  ASSERT_THAT(Orders(), SizeIs(1));
  EXPECT_EQ(Orders()[0].operation, "set_datum");
  Report(Orders()[0], S::STATE_SUCCEEDED);
  ASSERT_THAT(store_.events, Not(IsEmpty()));
  EXPECT_EQ(store_.events.back().kind, "datum_restored");
}

TEST_F(DispatcherMessagesTest, AnAcknowledgementOutlivesTheOutcomesOfOtherCommands) {
  auto body = Body(1, "acknowledge_alarm");
  body.arguments = {{"alarm", "battery_error"}};
  body.n_arguments = 1;
  Send(body);
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"alarm", "present", "acknowledged"}});
  ASSERT_THAT(store_.Marks("axis1"), SizeIs(1));
  driver_status_t status{};
  status.kind = driver_status_t::KIND_STATUS;
  status.device = "axis1";
  status.utime = now_.utime + 1'000'000;
  FromDriver(status);
  EXPECT_THAT(store_.Marks("axis1"), SizeIs(1));
  status.kind = driver_status_t::KIND_ACKNOWLEDGED;  // it names no alarm: the alarm has gone
  FromDriver(status);
  EXPECT_THAT(store_.Marks("axis1"), IsEmpty());
}

TEST_F(DispatcherMessagesTest, AJournalThatAnswersAtOnceIsReadWhenTheBridgeStarts) {
  bridge_.reset();
  bridge_ = MakeBridge(kBoot);
  EXPECT_EQ(ErrorText(bridge_->CheckJournal(now_.mono)), "");
}

TEST_F(DispatcherMessagesTest, EpochsAreReservedAsSoonAsAFullDiskHasRoom) {
  store_.is_full = true;
  RestartBridge(kBoot + 1);
  Step(10 * kMillisecond);
  const int reserved = store_.reserved;
  Pass(kSecond);
  EXPECT_EQ(store_.reserved, reserved) << "not while the disk is full";
  store_.is_full = false;
  Pass(kSecond);
  EXPECT_EQ(store_.reserved, reserved + 1);
}

TEST_F(DispatcherMessagesTest, AJournalThatIsSilentIsAskedOnce) {
  bridge_.reset();
  bridge_ = MakeBridge(kBoot, true);
  Pass(5 * kSecond);
  EXPECT_LE(journal_->waiting(), 2U) << "what earlier bridges left, and what is due";
  EXPECT_THAT(ErrorText(bridge_->CheckJournal(now_.mono)), Not(IsEmpty()));
  journal_->Recover();
  Pass(20 * kMillisecond);
  EXPECT_THAT(ErrorText(bridge_->CheckJournal(now_.mono)), IsEmpty());
}

TEST_F(DispatcherMessagesTest, ABridgeOnAFailedDiskReadsItsJournalWhenTheDiskIsBack) {
  Send(Body(1));
  store_.fails = true;
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  Pass(kSecond);
  store_.fails = false;
  PassWithDriver(2 * kSecond);
  EXPECT_THAT(Orders(), Not(IsEmpty())) << "the driver is asked about the command of the earlier bridge";
  EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_QUERY);
  EXPECT_EQ(IdOf(Orders().back().id), NumberedId(1));
}

// ---- refusals ----

TEST_F(DispatcherMessagesTest, OnlyADeniedCommandIsLogged) {
  Send(Body(1, "explode"));
  EXPECT_THAT(logged_, IsEmpty());
}

TEST_F(DispatcherMessagesTest, ADatumIsUndoneOnlyIfThereIsOne) {
  EXPECT_EQ(Send(Body(1, "undo_datum")).reason_code, S::REASON_NO_DATUM);
  EXPECT_THAT(Orders(), IsEmpty());
}

TEST_F(DispatcherMessagesTest, ACommitNamesTheArgumentsThatWerePrepared) {
  for (const bool same : {true, false}) {
    const std::uint32_t number = same ? 1 : 11;
    auto body = Body(number, "write");
    body.arguments = {{"address", "3"}, {"bytes", "A1"}};
    body.n_arguments = 2;
    SendAs(body, command_body_t::MODE_PREPARE);
    Report(Orders().back(), S::STATE_SUCCEEDED);
    const S prepared = Last();
    const CommandId id = NumberedId(number + 1);
    std::copy(id.begin(), id.end(), std::begin(body.id));
    std::copy(std::begin(prepared.token), std::end(prepared.token), std::begin(body.token));
    if (!same) body.arguments[1].value = "A2";
    const S committed = SendAs(body, command_body_t::MODE_COMMIT);
    EXPECT_EQ(committed.reason_code == S::REASON_TOKEN, !same);
    EXPECT_EQ(committed.state, same ? S::STATE_ROUTED + 0 : S::STATE_REJECTED + 0);
    if (same) Report(Orders().back(), S::STATE_SUCCEEDED);
  }
}

TEST_F(DispatcherMessagesTest, AnUndoIsPreparedAndCommittedWithoutArguments) {
  ASSERT_TRUE(store_.Apply("axis1", DatumRecord{.counts = 5, .utime = 1}));
  ASSERT_TRUE(store_.Apply("axis1", DatumRecord{.counts = 6, .utime = 2}));
  RestartBridge(kBoot);
  Hello(kDriver);
  SendAs(Body(1, "undo_datum"), command_body_t::MODE_PREPARE);
  ASSERT_THAT(Orders(), Not(IsEmpty()));
  EXPECT_EQ(Orders().back().operation, "set_datum");
  Report(Orders().back(), S::STATE_SUCCEEDED);
  auto commit = Body(2, "undo_datum");
  const S prepared = Last();
  std::copy(std::begin(prepared.token), std::end(prepared.token), std::begin(commit.token));
  EXPECT_EQ(SendAs(commit, command_body_t::MODE_COMMIT).state, S::STATE_ROUTED);
}

TEST_F(DispatcherMessagesTest, ACancelOfWhatIsOverOrUnknownChangesNoText) {
  Send(Body(1));
  driver_status_t done{};
  done.kind = driver_status_t::KIND_STATUS;
  const CommandId id = NumberedId(1);
  std::copy(id.begin(), id.end(), std::begin(done.id));
  done.state = S::STATE_SUCCEEDED;
  done.text = "bumped";
  FromDriver(done);
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_CANCEL).text, "bumped");
  const S unknown = SendAs(Body(2), command_body_t::MODE_CANCEL);
  EXPECT_EQ(unknown.state, S::STATE_UNKNOWN);
  EXPECT_EQ(unknown.reason_code, S::REASON_NONE);
  journal_->Stall();
  Step(10 * kMillisecond);
  SendAs(Body(3), command_body_t::MODE_CANCEL);
  Pass(JournalQueue::kSlow + 20 * kMillisecond);
  EXPECT_EQ(Last().state, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().reason_code, S::REASON_JOURNAL);
  EXPECT_THAT(Last().text, HasSubstr("ask again later"));
}

TEST_F(DispatcherMessagesTest, WithoutItsDriverACommandIsRefusedWithWhatToStart) {
  Hello(kDriver, false, driver_status_t::KIND_GOODBYE);
  for (const char* operation : {"bump", "look"}) {
    const S status = Send(Body(operation[0] == 'b' ? 1 : 2, operation));
    EXPECT_EQ(status.state, S::STATE_REJECTED) << operation;
    EXPECT_EQ(status.reason_code, S::REASON_DRIVER_ABSENT) << operation;
    EXPECT_THAT(status.text, HasSubstr("is not running: start it")) << operation;
  }
  Pass(kSecond);
  EXPECT_THAT(Orders(), IsEmpty());
}

// ---- questions while the journal does not answer ----

TEST_F(DispatcherMessagesTest, AQuestionIsAnsweredOnceAlthoughTheJournalIsSlow) {
  journal_->Stall();
  Step(10 * kMillisecond);
  SendAs(Body(9), command_body_t::MODE_QUERY);
  Step(JournalQueue::kSlow);
  EXPECT_EQ(Statuses(), 0U) << "it may still answer";
  Step(1);
  EXPECT_EQ(Statuses(), 1U);
  EXPECT_EQ(Last().state, S::STATE_UNKNOWN);
  EXPECT_THAT(Last().text, HasSubstr("ask again later"));
  Pass(kSecond);
  journal_->Recover();
  Pass(100 * kMillisecond);
  EXPECT_EQ(Statuses(), 1U);
}

TEST_F(DispatcherMessagesTest, EveryQuestionIsAnsweredWhileTheJournalAnswers) {
  for (std::uint32_t number = 1; number <= 3'000; ++number) {
    sink_.Clear();
    SendAs(Body(number), command_body_t::MODE_QUERY);
    ASSERT_EQ(Statuses(), 1U) << number;
  }
}

TEST_F(DispatcherMessagesTest, AJournalThatWasNotReadYetIsNamedSo) {
  bridge_.reset();
  bridge_ = MakeBridge(kBoot, true);
  EXPECT_THAT(ErrorText(bridge_->CheckJournal(now_.mono)), HasSubstr("has not been read yet"));
}

TEST_F(DispatcherMessagesTest, AtMost100QuestionsWaitForTheJournal) {
  journal_->Stall();
  Step(10 * kMillisecond);
  for (std::uint32_t number = 1; number <= 150; ++number) SendAs(Body(number), command_body_t::MODE_QUERY);
  Step(JournalQueue::kSlow + 1);
  EXPECT_EQ(Statuses(), 100U);
}

TEST_F(DispatcherMessagesTest, TheJournalIsReadAndItsEpochsReservedOnce) {
  RestartBridge(kBoot + 1);
  store_.opened = 0;
  RestartBridge(kBoot + 2);
  const int reserved = store_.reserved;
  const int ticks = store_.ticks;
  PassWithDriver(2 * kSecond);
  EXPECT_EQ(store_.opened, 1);
  EXPECT_EQ(store_.reserved, reserved);
  EXPECT_GE(store_.ticks, ticks + 200) << "it does what is due at each tick";
}

TEST_F(DispatcherMessagesTest, EpochsAreReservedWhenTheDiskIsBack) {
  store_.fails = true;
  RestartBridge(kBoot + 1);
  Pass(kSecond);
  const int reserved = store_.reserved;
  store_.fails = false;
  PassWithDriver(2 * kSecond);
  EXPECT_GT(store_.reserved, reserved);
  const int after = store_.reserved;
  PassWithDriver(2 * kSecond);
  EXPECT_EQ(store_.reserved, after);
}

// ---- what an earlier bridge had ----

TEST_F(DispatcherMessagesTest, AnIdOfTheJournalIsAnsweredWithItsOutcomeOrRefused) {
  const auto body = Body(1);
  Send(body);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  RestartBridge(kBoot);
  Hello(kDriver);
  EXPECT_EQ(Send(body).state, S::STATE_SUCCEEDED);
  EXPECT_THAT(Orders(), IsEmpty());
  EXPECT_EQ(Send(Body(1, "halt")).reason_code, S::REASON_ID_REUSED);
  EXPECT_THAT(Orders(), IsEmpty());
  EXPECT_EQ(Send(body).state, S::STATE_SUCCEEDED) << "the first is still known";
  EXPECT_EQ(Send(Body(2)).state, S::STATE_ROUTED) << "nothing waits in its queue";
}

TEST_F(DispatcherMessagesTest, ACommandIsStoredWithItsEnd) {
  auto body = Body(1);
  body.valid_ms = 2'000;
  body.reason = "because";
  Send(body);
  ASSERT_THAT(store_.Open(), SizeIs(1));
  const CommandRecord record = store_.Open()[0].record;
  EXPECT_EQ(record.utime, now_.utime);
  EXPECT_EQ(record.begin_by_utime, now_.utime + 2'000'000);
  EXPECT_EQ(record.reason, "because");
  EXPECT_EQ(record.bridge_boot_id, kBoot);
}

TEST_F(DispatcherMessagesTest, UnauthorizedMessagesAreNotedAsAnEvent) {
  bridge_->OnCommand(std::vector<std::uint8_t>{1, 2, 3}, now_);
  Step(10 * kMillisecond);
  ASSERT_THAT(store_.events, Not(IsEmpty()));
  EXPECT_EQ(store_.events.back().kind, "foreign");
  EXPECT_THAT(store_.events.back().text, HasSubstr("cannot be read"));
}

// ---- the driver ----

TEST_F(DispatcherMessagesTest, ADeviceThatTheMachineHasNotIsIgnored) {
  HelloWith(kDriver, OnlineDevice("axis9"));
  EXPECT_EQ(Send(Body(1)).state, S::STATE_ROUTED);
}

TEST_F(DispatcherMessagesTest, ABridgeThatJustStartedWaitsForItsDriver) {
  RestartBridge(kBoot);
  EXPECT_EQ(Send(Body(1)).state, S::STATE_ACCEPTED);
  EXPECT_THAT(Orders(), IsEmpty());
  Hello(kDriver);
  EXPECT_THAT(Orders(), SizeIs(1));
}

TEST_F(DispatcherMessagesTest, MessagesOfOtherChannelsAndOfUnknownBootsChangeNothing) {
  driver_status_t status{};
  status.kind = driver_status_t::KIND_STATUS;
  status.bus = "b0";
  status.boot_id = kDriver + 5;
  status.bridge_epoch = std::int64_t{1} << 60;
  bridge_->OnDriverStatus("X", Encoded(status), now_);
  bridge_->OnDriverStatus("DRIVER_STATUS/b0", Encoded(status), now_);
  Send(Body(1));
  ASSERT_THAT(Orders(), SizeIs(1));
  EXPECT_LT(Orders().back().bridge_epoch, status.bridge_epoch);
}

// An operation of the runtime changes only the driver that has it: a driver that restarted has lost it.
TEST_F(DispatcherMessagesTest, WhatARestartedDriverWouldHaveKeptHadNoEffect) {
  auto body = Body(1, "acknowledge_alarm");
  body.arguments = {{"alarm", "battery_error"}};
  body.n_arguments = 1;
  body.reason = "known";
  Send(body);
  ASSERT_THAT(Orders(), SizeIs(1));
  Hello(kDriver + 1);
  EXPECT_EQ(Last().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Last().finding, S::FINDING_NO_EFFECT_SEEN);
}

TEST_F(DispatcherMessagesTest, WhatASilentDriverMayHaveKeptIsAskedFor) {
  auto body = Body(1, "acknowledge_alarm");
  body.arguments = {{"alarm", "battery_error"}};
  body.n_arguments = 1;
  body.reason = "known";
  body.valid_ms = 60'000;
  Send(body);
  PassWithDriver(6 * kSecond);
  EXPECT_EQ(Last().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Last().reason_code, S::REASON_DRIVER_SILENT);
  EXPECT_EQ(Last().finding, S::FINDING_NONE);
}

}  // namespace
}  // namespace axlecast
