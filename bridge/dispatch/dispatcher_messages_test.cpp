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

// ---- headers, ids and epochs ----

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
  for (std::uint32_t number = 1; number <= 2; ++number) {
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
