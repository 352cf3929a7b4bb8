#include "bridge/dispatch/device_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <utility>
#include <vector>

#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "tests/support/counting_family.h"

namespace axlecast {
namespace {

using S = command_status_t;
using Order = driver_order_t;
using Purpose = PendingCommand::Purpose;
using JournalState = PendingCommand::JournalState;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::int64_t kDriverBoot = 7;
constexpr MonoNs kMs = kMillisecond;

const OperationSpec kZero = {.name = "zero", .help = ""};
const OperationSpec kRead = {.name = "read", .help = "", .reads_only = true};
const OperationSpec kStop = {.name = "stop", .help = "", .urgent = true};

struct Sent {
  std::int8_t kind;
  std::int32_t valid_ms;
  MonoNs at;
};

class Listener final : public DeviceQueueListener {
 public:
  std::int64_t Send(const PendingCommand& /*pending*/, std::int8_t kind, std::int32_t valid_ms,
                    Timestamp now) override {
    sent.push_back({kind, valid_ms, now.mono});
    return ++epoch;
  }
  CommandId NewId() override { return NumberedId(900); }
  Result<> BeforeRoute(PendingCommand& pending, Timestamp /*now*/) override {
    if (refuses) return Failure("interlock", S::REASON_NOT_PERMITTED);
    pending.journal_state = journals ? JournalState::kRouted : JournalState::kReady;
    return {};
  }
  Result<> CheckJournalWait(const PendingCommand& /*pending*/, Timestamp /*now*/) override {
    return journal_is_late ? Failure("the journal is late", S::REASON_JOURNAL) : Result<>();
  }
  void OnStep(PendingCommand& pending, Timestamp /*now*/) override { steps.push_back(pending.status); }
  void OnEnd(PendingCommand pending, Timestamp /*now*/) override { ended.push_back(std::move(pending)); }

  [[nodiscard]] std::vector<std::int8_t> kinds() const {
    std::vector<std::int8_t> all;
    for (const Sent& one : sent) all.push_back(one.kind);
    return all;
  }

  bool refuses = false;
  bool journals = false;
  bool journal_is_late = false;
  std::int64_t epoch = 100;
  std::vector<Sent> sent;
  std::vector<S> steps;
  std::vector<PendingCommand> ended;
};

class DeviceQueueTest : public testing::Test {
 protected:
  DeviceQueueTest() {
    DeviceConfig axis;
    axis.name = "axis1";
    link_.Expect({axis});
    link_.ListenFrom(now_.mono);
    Hello(kDriverBoot);
  }
  void Hello(std::int64_t boot_id, std::int8_t kind = driver_status_t::KIND_HELLO,
             std::int8_t state = device_info_t::STATE_ONLINE) {
    driver_status_t hello{};
    hello.boot_id = boot_id;
    hello.kind = kind;
    driver_device_t device{};
    device.device = "axis1";
    device.state = state;
    hello.devices = {device};
    static_cast<void>(link_.On(hello, now_.mono));
  }
  static PendingCommand Command(std::uint32_t number, const OperationSpec& operation = kZero) {
    PendingCommand pending;
    pending.id = NumberedId(number);
    pending.device = "axis1";
    pending.operation = &operation;
    pending.who = "sender" + std::to_string(number);
    return pending;
  }
  void Pass(MonoNs time) {
    now_.mono += time;
    now_.utime += time / kMicrosecond;
  }
  // Time in steps of 1 ms; the driver stays present.
  void Tick(MonoNs time) {
    for (const MonoNs end = now_.mono + time; now_.mono < end;) {
      Pass(kMs);
      if (now_.mono % kSecond == 0) Hello(kDriverBoot);
      queue_.Tick(now_);
    }
  }
  // Routes it: it is with the driver then.
  void Routed(PendingCommand pending) {
    queue_.Push(std::move(pending));
    queue_.Tick(now_);
  }
  driver_status_t Status(std::uint32_t number, std::int8_t state) {
    driver_status_t status{};
    const CommandId id = NumberedId(number);
    std::copy(id.begin(), id.end(), std::begin(status.id));
    status.boot_id = kDriverBoot;
    status.seq = ++seq_;
    status.state = state;
    status.bridge_epoch = listener_.epoch;
    return status;
  }
  void On(const driver_status_t& status) { queue_.OnStatus(status, now_); }
  [[nodiscard]] S Outcome() const { return listener_.ended.empty() ? S{} : listener_.ended.back().status; }

  Timestamp now_{1'000 * kSecond, 1'700'000'000'000'000};
  DriverLink link_;
  Listener listener_;
  DeviceQueue queue_{link_, listener_};
  std::int64_t seq_ = 0;
};

// ---- to the driver ----

TEST_F(DeviceQueueTest, RepeatsACommandUntilTheDriverAcknowledgesIt) {
  Routed(Command(1));
  EXPECT_THAT(listener_.sent, SizeIs(1));
  Tick(19 * kMs);
  EXPECT_THAT(listener_.sent, SizeIs(1));
  Tick(kMs);
  EXPECT_THAT(listener_.sent, SizeIs(2));
  Tick(kSecond - 21 * kMs);
  EXPECT_THAT(listener_.sent, SizeIs(50)) << "every 20 ms in the first second";
  Tick(kSecond);
  EXPECT_THAT(listener_.sent, SizeIs(55)) << "then every 200 ms";
  for (const Sent& one : listener_.sent) EXPECT_EQ(one.kind, Order::KIND_EXECUTE);
}

TEST_F(DeviceQueueTest, AsksAboutACommandThatTheDriverHasAcknowledged) {
  Routed(Command(1));
  On(Status(1, S::STATE_ROUTED));
  listener_.sent.clear();
  Tick(249 * kMs);
  EXPECT_THAT(listener_.sent, IsEmpty());
  Tick(kMs);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_QUERY));
  EXPECT_EQ(listener_.sent[0].valid_ms, 1);
  On(Status(1, S::STATE_RUNNING));
  Tick(250 * kMs);
  EXPECT_THAT(listener_.sent, SizeIs(2)) << "a later status does not delay it";
}

TEST_F(DeviceQueueTest, AnOrderIsValidForWhatIsLeftOfItsTime) {
  PendingCommand pending = Command(1);
  pending.begin_by = now_.mono + 2'500 * kMs + 1;
  Routed(pending);
  EXPECT_EQ(listener_.sent.back().valid_ms, 2'500);
  Tick(2'400 * kMs);
  EXPECT_EQ(listener_.sent.back().valid_ms, 100);
  Tick(200 * kMs);
  EXPECT_EQ(listener_.sent.back().kind, Order::KIND_QUERY) << "its time is over: it is not ordered again";
}

TEST_F(DeviceQueueTest, AnOrderWithoutEndIsValidForAnHourAndOneThatEndsForAMillisecond) {
  Routed(Command(1));
  EXPECT_EQ(listener_.sent.back().valid_ms, 3'600'000);
  On(Status(1, S::STATE_SUCCEEDED));
  PendingCommand pending = Command(2);
  pending.begin_by = now_.mono + 1;
  Routed(pending);
  EXPECT_EQ(listener_.sent.back().valid_ms, 1);
}

TEST_F(DeviceQueueTest, APreparedCommandIsOnlyPrepared) {
  PendingCommand pending = Command(1);
  pending.prepare = true;
  Routed(pending);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_PREPARE));
}

TEST_F(DeviceQueueTest, OneCommandAtATimeInTheirOrder) {
  queue_.Push(Command(1));
  queue_.Push(Command(2));
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(1));
  EXPECT_THAT(listener_.steps, SizeIs(1));
  EXPECT_EQ(listener_.steps[0].state, S::STATE_ROUTED);
  EXPECT_EQ(listener_.steps[0].driver_boot_id, kDriverBoot);
  On(Status(2, S::STATE_SUCCEEDED));
  EXPECT_THAT(listener_.ended, IsEmpty()) << "it is not with the driver";
  On(Status(1, S::STATE_SUCCEEDED));
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(listener_.ended[0].id, NumberedId(1));
  queue_.Tick(now_);
  On(Status(2, S::STATE_SUCCEEDED));
  EXPECT_THAT(listener_.ended, SizeIs(2));
  EXPECT_TRUE(queue_.IsIdle());
}

TEST_F(DeviceQueueTest, WhatMayNotBeRoutedEndsAndTheNextFollowsAtOnce) {
  listener_.refuses = true;
  queue_.Push(Command(1));
  queue_.Push(Command(2));
  queue_.Tick(now_);
  ASSERT_THAT(listener_.ended, SizeIs(2));
  EXPECT_EQ(Outcome().state, S::STATE_REJECTED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_NOT_PERMITTED);
  EXPECT_EQ(Outcome().text, "interlock");
  EXPECT_EQ(Outcome().finished_utime, now_.utime);
  EXPECT_THAT(listener_.sent, IsEmpty());
}

// ---- from the driver ----

TEST_F(DeviceQueueTest, PassesOnWhatTheDriverReports) {
  Routed(Command(1));
  driver_status_t status = Status(1, S::STATE_RUNNING);
  status.progress = 40;
  status.text = "moving";
  status.started_utime = 5;
  status.changes = {{"a", "1", "2"}, {"b", "", "3"}};
  On(status);
  S reported = listener_.steps.back();
  EXPECT_EQ(reported.state, S::STATE_RUNNING);
  EXPECT_EQ(reported.progress, 40);
  EXPECT_EQ(reported.text, "moving");
  EXPECT_EQ(reported.started_utime, 5);
  EXPECT_EQ(reported.n_changes, 2);
  EXPECT_EQ(reported.changes[0].before, "1");

  status = Status(1, S::STATE_SUCCEEDED);
  status.verified = 1;
  status.finished_utime = 9;
  status.epoch_after = 3;
  status.nv_writes = 2;
  status.changes.assign(kMaxChanges + 1, {"c", "", "4"});
  On(status);
  reported = Outcome();
  EXPECT_EQ(reported.verified, 1);
  EXPECT_EQ(reported.finished_utime, 9);
  EXPECT_EQ(reported.epoch_after, 3);
  EXPECT_EQ(listener_.ended.back().nv_writes, 2);
  ASSERT_THAT(reported.changes, SizeIs(kMaxChanges)) << "those of before are replaced";
  EXPECT_EQ(reported.changes[0].key, "c");
}

TEST_F(DeviceQueueTest, AStepIsReportedIfStateProgressOrTextChange) {
  Routed(Command(1));
  const auto steps = [this](std::int8_t state, std::int8_t progress, const char* text) {
    const std::size_t before = listener_.steps.size();
    driver_status_t status = Status(1, state);
    status.progress = progress;
    status.text = text;
    On(status);
    return listener_.steps.size() - before;
  };
  EXPECT_EQ(steps(S::STATE_ROUTED, 0, ""), 1U) << "the first is the acknowledgement";
  EXPECT_EQ(steps(S::STATE_ROUTED, 0, ""), 0U);
  EXPECT_EQ(steps(S::STATE_RUNNING, 0, ""), 1U);
  EXPECT_EQ(steps(S::STATE_RUNNING, 10, ""), 1U);
  EXPECT_EQ(steps(S::STATE_RUNNING, 10, "moving"), 1U);
  EXPECT_EQ(steps(S::STATE_RUNNING, 10, "moving"), 0U);
}

TEST_F(DeviceQueueTest, IgnoresWhatIsOvertakenOfAnotherBootOrNoProgress) {
  Routed(Command(1));
  On(Status(1, S::STATE_RUNNING));
  const std::size_t steps = listener_.steps.size();
  driver_status_t repeated = Status(1, S::STATE_SUCCEEDED);
  repeated.seq = --seq_;
  On(repeated);
  driver_status_t other_boot = Status(1, S::STATE_SUCCEEDED);
  other_boot.boot_id = 8;
  On(other_boot);
  driver_status_t accepted = Status(1, S::STATE_ACCEPTED);
  accepted.progress = 50;
  On(accepted);
  EXPECT_THAT(listener_.steps, SizeIs(steps));
  EXPECT_THAT(listener_.ended, IsEmpty());
}

TEST_F(DeviceQueueTest, ADriverIsSilentFiveSecondsAfterItsLastStatus) {
  Routed(Command(1));
  Tick(4 * kSecond);
  On(Status(1, S::STATE_RUNNING));
  Tick(5 * kSecond);
  EXPECT_THAT(listener_.ended, IsEmpty());
  Tick(kMs);
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DRIVER_SILENT);
  EXPECT_EQ(Outcome().finished_utime, now_.utime);
}

TEST_F(DeviceQueueTest, WhatTheDriverDoesNotKnowIsOrderedAgain) {
  Routed(Command(1));
  On(Status(1, S::STATE_RUNNING));
  listener_.sent.clear();
  driver_status_t unknown = Status(1, S::STATE_UNKNOWN);
  unknown.bridge_epoch = listener_.epoch - 1;
  On(unknown);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty()) << "it knows only earlier orders";
  On(Status(1, S::STATE_UNKNOWN));
  queue_.Tick(now_);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_EXECUTE));
}

TEST_F(DeviceQueueTest, WhatTheDriverDoesNotKnowWhenItsTimeIsOverIsExpired) {
  PendingCommand pending = Command(1);
  pending.begin_by = now_.mono + kSecond;
  Routed(pending);
  Pass(kSecond);
  On(Status(1, S::STATE_UNKNOWN));
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().state, S::STATE_EXPIRED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DEADLINE);
}

TEST_F(DeviceQueueTest, ADriverThatRestartsOrStopsLeavesAnIndeterminateCommand) {
  Routed(Command(1));
  Hello(8);
  queue_.Tick(now_);
  EXPECT_EQ(Outcome().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DRIVER_RESTARTED);
  Routed(Command(2));
  Hello(8, driver_status_t::KIND_GOODBYE);
  queue_.Tick(now_);
  EXPECT_EQ(Outcome().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Outcome().reason_code, S::REASON_STOPPING);
  EXPECT_THAT(listener_.ended, SizeIs(2));
}

TEST_F(DeviceQueueTest, OfALostReadOrPrepareNothingIsDone) {
  Routed(Command(1, kRead));
  Hello(8);
  queue_.Tick(now_);
  EXPECT_EQ(Outcome().state, S::STATE_REJECTED);
  PendingCommand prepare = Command(2);
  prepare.prepare = true;
  Routed(prepare);
  Hello(9);
  queue_.Tick(now_);
  EXPECT_EQ(Outcome().state, S::STATE_REJECTED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DRIVER_RESTARTED);
}

// ---- cancelling ----

TEST_F(DeviceQueueTest, ACommandOfAnEarlierBridgeThatWaitsIsInTheQueue) {
  Routed(Command(1));
  PendingCommand recovered = Command(2);
  recovered.status.driver_boot_id = kDriverBoot;
  queue_.PushRecovered(recovered);
  EXPECT_TRUE(queue_.Cancel(NumberedId(2), now_));
  EXPECT_THAT(listener_.ended, IsEmpty()) << "its driver may have executed it";
}

TEST_F(DeviceQueueTest, AWaitingCommandIsCancelledAtOnce) {
  Routed(Command(1));
  queue_.Push(Command(2));
  EXPECT_TRUE(queue_.Cancel(NumberedId(2), now_));
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(listener_.ended[0].id, NumberedId(2));
  EXPECT_EQ(Outcome().state, S::STATE_CANCELLED);
  EXPECT_FALSE(queue_.Cancel(NumberedId(2), now_));
  EXPECT_FALSE(queue_.Cancel(NumberedId(3), now_));
}

TEST_F(DeviceQueueTest, TheDriverIsAskedToCancelARoutedCommandUntilItEnds) {
  Routed(Command(1));
  On(Status(1, S::STATE_RUNNING));
  listener_.sent.clear();
  EXPECT_TRUE(queue_.Cancel(NumberedId(1), now_));
  EXPECT_TRUE(queue_.Cancel(NumberedId(1), now_));
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_CANCEL)) << "once at once";
  EXPECT_EQ(listener_.sent[0].valid_ms, 1);
  Tick(20 * kMs);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_CANCEL, Order::KIND_CANCEL)) << "then every 20 ms";
  EXPECT_THAT(listener_.ended, IsEmpty());
}

// ---- what waits ----

TEST_F(DeviceQueueTest, KnowsWhoGaveWhatIsHere) {
  Routed(Command(1));
  queue_.Push(Command(2));
  EXPECT_EQ(queue_.SenderOf(NumberedId(1)), "sender1");
  EXPECT_EQ(queue_.SenderOf(NumberedId(2)), "sender2");
  EXPECT_EQ(queue_.SenderOf(NumberedId(3)), std::nullopt);
}

TEST_F(DeviceQueueTest, KnowsThePurposeOfWhatIsHere) {
  EXPECT_FALSE(queue_.Holds(Purpose::kCommand));
  Routed(Command(1));
  EXPECT_TRUE(queue_.Holds(Purpose::kCommand));
  EXPECT_FALSE(queue_.Holds(Purpose::kRestore));
  PendingCommand restore = Command(2);
  restore.purpose = Purpose::kRestore;
  queue_.Push(restore);
  EXPECT_TRUE(queue_.Holds(Purpose::kRestore));
  EXPECT_TRUE(queue_.Holds(Purpose::kCommand));
}

TEST_F(DeviceQueueTest, HoldsThirtyTwoWaitingCommands) {
  for (std::uint32_t i = 0; i < DeviceQueue::kMaxWaiting; ++i) {
    EXPECT_FALSE(queue_.IsFull());
    queue_.Push(Command(i));
  }
  EXPECT_TRUE(queue_.IsFull());
}

TEST_F(DeviceQueueTest, AWaitingCommandExpiresAtItsTime) {
  Routed(Command(1));
  PendingCommand pending = Command(2);
  pending.begin_by = now_.mono + kSecond;
  queue_.Push(pending);
  Pass(kSecond - 1);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.ended, IsEmpty());
  Pass(1);
  queue_.Tick(now_);
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(listener_.ended[0].id, NumberedId(2));
  EXPECT_EQ(Outcome().state, S::STATE_EXPIRED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DEADLINE);
}

TEST_F(DeviceQueueTest, WithoutItsDriverAWaitingCommandIsRejectedButNoOutcomeCheck) {
  Hello(kDriverBoot, driver_status_t::KIND_GOODBYE);
  PendingCommand check = Command(2, kRead);
  check.purpose = Purpose::kOutcomeCheck;
  queue_.Push(Command(1));
  queue_.Push(check);
  queue_.Tick(now_);
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().state, S::STATE_REJECTED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DRIVER_ABSENT);
  EXPECT_TRUE(queue_.Holds(Purpose::kOutcomeCheck));
  EXPECT_THAT(listener_.sent, IsEmpty());
}

// ---- the journal ----

TEST_F(DeviceQueueTest, ACommandIsRoutedWhenItsAcceptanceIsWritten) {
  PendingCommand pending = Command(1);
  pending.journal_state = JournalState::kAccepted;
  queue_.Push(pending);
  queue_.Push(Command(2));
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty());
  EXPECT_TRUE(queue_.IsAwaitingAcceptance(NumberedId(1)));
  EXPECT_FALSE(queue_.IsAwaitingAcceptance(NumberedId(2)));
  queue_.OnJournalled(NumberedId(1), JournalState::kAccepted, true, {}, now_);
  EXPECT_FALSE(queue_.IsAwaitingAcceptance(NumberedId(1)));
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(1));
}

TEST_F(DeviceQueueTest, ACommandIsSentWhenItsRoutingIsWritten) {
  listener_.journals = true;
  queue_.Push(Command(1));
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty());
  queue_.OnJournalled(NumberedId(1), JournalState::kAccepted, true, {}, now_);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty()) << "it does not wait for this entry";
  queue_.OnJournalled(NumberedId(1), JournalState::kRouted, true, {}, now_);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(1));
}

TEST_F(DeviceQueueTest, WhatAnotherEntryOfTheJournalFailsForChangesNothing) {
  listener_.journals = true;
  queue_.Push(Command(1));
  queue_.Tick(now_);
  queue_.OnJournalled(NumberedId(1), JournalState::kAccepted, false, {"full disk", S::REASON_JOURNAL}, now_);
  queue_.OnJournalled(NumberedId(2), JournalState::kRouted, false, {"full disk", S::REASON_JOURNAL}, now_);
  EXPECT_THAT(listener_.ended, IsEmpty());
  queue_.OnJournalled(NumberedId(1), JournalState::kRouted, true, {}, now_);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(1));
}

TEST_F(DeviceQueueTest, AnUrgentCommandWaitsFiftyMillisecondsForItsRouting) {
  listener_.journals = true;
  queue_.Push(Command(1, kStop));
  queue_.Tick(now_);
  Pass(DeviceQueue::kOvertaken);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty());
  Pass(1);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(1));
}

TEST_F(DeviceQueueTest, ADriverThatRestartsBeforeTheOrderIsSentGetsNothing) {
  listener_.journals = true;
  queue_.Push(Command(1));
  queue_.Tick(now_);
  Hello(8);
  queue_.OnJournalled(NumberedId(1), JournalState::kRouted, true, {}, now_);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty());
  EXPECT_EQ(Outcome().state, S::STATE_REJECTED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DRIVER_RESTARTED);
}

TEST_F(DeviceQueueTest, WhatTheJournalCannotWriteIsRejectedUnlessItIsUrgent) {
  for (const OperationSpec* operation : {&kZero, &kStop}) {
    PendingCommand pending = Command(1, *operation);
    pending.journal_state = JournalState::kAccepted;
    pending.journal_since = now_.mono;
    queue_.Push(pending);
    queue_.OnJournalled(NumberedId(1), JournalState::kAccepted, false, {"full disk", S::REASON_JOURNAL}, now_);
  }
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().state, S::STATE_REJECTED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_JOURNAL);
  EXPECT_EQ(Outcome().text, "full disk");
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(1));
}

TEST_F(DeviceQueueTest, AnUrgentCommandWaitsFiftyMillisecondsForTheJournal) {
  PendingCommand pending = Command(1, kStop);
  pending.journal_state = JournalState::kAccepted;
  pending.journal_since = now_.mono;
  queue_.Push(pending);
  listener_.journal_is_late = false;
  Pass(DeviceQueue::kOvertaken);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty());
  listener_.journal_is_late = true;
  Pass(1);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(1));
  EXPECT_THAT(listener_.ended, IsEmpty());
}

TEST_F(DeviceQueueTest, ACommandThatWaitedTooLongForTheJournalIsRejected) {
  PendingCommand pending = Command(1);
  pending.journal_state = JournalState::kAccepted;
  queue_.Push(pending);
  queue_.Push(Command(2));
  listener_.journal_is_late = true;
  queue_.Tick(now_);
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().reason_code, S::REASON_JOURNAL);
  EXPECT_THAT(listener_.sent, SizeIs(1)) << "the other waits for nothing";
}

TEST_F(DeviceQueueTest, AReadPassesACommandThatWaitsForASlowJournal) {
  PendingCommand first = Command(1);
  first.journal_state = JournalState::kAccepted;
  first.journal_since = now_.mono;
  queue_.Push(first);
  queue_.Push(Command(2));
  queue_.Push(Command(3, kRead));
  Pass(DeviceQueue::kOvertaken);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty()) << "not yet";
  Pass(1);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(1));
  On(Status(3, S::STATE_SUCCEEDED));
  EXPECT_THAT(listener_.ended, SizeIs(1));
  PendingCommand prepare = Command(4);
  prepare.prepare = true;
  queue_.Push(prepare);
  queue_.Tick(now_);
  On(Status(4, S::STATE_SUCCEEDED));
  EXPECT_THAT(listener_.ended, SizeIs(2)) << "so does a command that is only prepared";
}

TEST_F(DeviceQueueTest, AnOutcomeCheckThatNoOperationMakesPassesNoCommand) {
  PendingCommand first = Command(1);
  first.journal_state = JournalState::kAccepted;
  first.journal_since = now_.mono;
  queue_.Push(first);
  PendingCommand check = Command(2);
  check.purpose = Purpose::kOutcomeCheck;
  check.operation = nullptr;
  check.about_silent = true;
  check.about_boot_id = kDriverBoot;
  check.begin_by = now_.mono + 60 * kSecond;
  queue_.Push(check);
  Pass(DeviceQueue::kOvertaken + 1);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty());
  queue_.OnJournalled(NumberedId(1), JournalState::kAccepted, true, {}, now_);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_EXECUTE));
}

TEST_F(DeviceQueueTest, OnlyACommandOfAClientIsCancelled) {
  EXPECT_FALSE(queue_.Cancel(NumberedId(1), now_)) << "it does not exist";
  PendingCommand restore = Command(1);
  restore.purpose = Purpose::kRestore;
  Routed(restore);
  ASSERT_THAT(listener_.kinds(), ElementsAre(Order::KIND_EXECUTE));
  EXPECT_FALSE(queue_.Cancel(NumberedId(900), now_)) << "its id is of the bridge";
  EXPECT_FALSE(queue_.Cancel(NumberedId(2), now_));
  EXPECT_THAT(listener_.sent, SizeIs(1));
}

TEST_F(DeviceQueueTest, ACommandWhoseAcceptanceIsBeingWrittenCanBeWithdrawn) {
  PendingCommand pending = Command(1);
  pending.journal_state = JournalState::kAccepted;
  queue_.Push(pending);
  queue_.Push(Command(2));
  EXPECT_FALSE(queue_.Withdraw(NumberedId(2)));
  const std::optional<PendingCommand> withdrawn = queue_.Withdraw(NumberedId(1));
  ASSERT_TRUE(withdrawn);
  EXPECT_EQ(withdrawn->id, NumberedId(1));
  EXPECT_FALSE(queue_.Withdraw(NumberedId(1)));
  EXPECT_THAT(listener_.ended, IsEmpty());
}

// ---- recovered commands, and outcome checks ----

TEST_F(DeviceQueueTest, ARecoveredCommandIsAskedAboutAndNeverOrdered) {
  queue_.Push(Command(1));
  PendingCommand recovered = Command(2);
  recovered.status.driver_boot_id = kDriverBoot;
  recovered.sent_epoch = listener_.epoch;
  recovered.journal_state = JournalState::kAccepted;
  queue_.PushRecovered(recovered);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_QUERY)) << "before any other";
  On(Status(2, S::STATE_UNKNOWN));
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().state, S::STATE_REJECTED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_BRIDGE_RESTARTED);
}

TEST_F(DeviceQueueTest, TheOutcomeOfASilentDriverIsAskedForUnderTheFirstId) {
  PendingCommand check = Command(1, kRead);
  check.purpose = Purpose::kOutcomeCheck;
  check.about = NumberedId(50);
  check.about_boot_id = kDriverBoot;
  check.about_epoch = 100;
  check.about_silent = true;
  check.begin_by = now_.mono + 60 * kSecond;
  Routed(check);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_QUERY));
  driver_status_t early = Status(50, S::STATE_UNKNOWN);
  early.bridge_epoch = 99;
  On(early);
  EXPECT_THAT(listener_.ended, IsEmpty());
  driver_status_t unknown = Status(50, S::STATE_UNKNOWN);
  unknown.bridge_epoch = 100;
  On(unknown);
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().state, S::STATE_EXPIRED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DRIVER_SILENT);
}

TEST_F(DeviceQueueTest, AnOutcomeCheckWaitsUntilTheDeviceAnswers) {
  PendingCommand check = Command(1, kRead);
  check.purpose = Purpose::kOutcomeCheck;
  check.not_before = now_.mono + kSecond;
  check.begin_by = now_.mono + 60 * kSecond;
  Routed(check);
  EXPECT_THAT(listener_.sent, IsEmpty()) << "not before its time";
  Hello(kDriverBoot, driver_status_t::KIND_HELLO, device_info_t::STATE_OFFLINE);
  Pass(kSecond);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, IsEmpty());
  Hello(kDriverBoot);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_EXECUTE));
  On(Status(900, S::STATE_SUCCEEDED));
  ASSERT_THAT(listener_.ended, SizeIs(1)) << "under an id of the bridge";
}

TEST_F(DeviceQueueTest, AnOutcomeCheckOutlivesItsDriverUntilItsTimeIsOver) {
  PendingCommand check = Command(1, kRead);
  check.purpose = Purpose::kOutcomeCheck;
  check.begin_by = now_.mono + 2 * kSecond;
  Routed(check);
  ASSERT_THAT(listener_.sent, SizeIs(1));
  Hello(8);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.ended, IsEmpty());
  EXPECT_TRUE(queue_.Holds(Purpose::kOutcomeCheck));
  queue_.Tick(now_);
  EXPECT_THAT(listener_.sent, SizeIs(2)) << "from the new driver";
  Pass(2 * kSecond);
  queue_.Tick(now_);
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().state, S::STATE_EXPIRED);
  EXPECT_EQ(Outcome().reason_code, S::REASON_DEADLINE);
}

TEST_F(DeviceQueueTest, ANewDriverGetsAnOutcomeCheckAsIfItWereTheFirst) {
  PendingCommand check = Command(1, kRead);
  check.purpose = Purpose::kOutcomeCheck;
  check.begin_by = now_.mono + 60 * kSecond;
  Routed(check);
  On(Status(900, S::STATE_RUNNING));
  On(Status(900, S::STATE_RUNNING));
  listener_.sent.clear();
  Hello(8);
  queue_.Tick(now_);
  EXPECT_THAT(listener_.kinds(), ElementsAre(Order::KIND_EXECUTE));
  driver_status_t done = Status(900, S::STATE_SUCCEEDED);
  done.boot_id = 8;
  done.seq = 0;
  On(done);
  EXPECT_THAT(listener_.ended, SizeIs(1)) << "its numbers begin again";
}

TEST_F(DeviceQueueTest, OnlyTheDriverThatWasSilentIsAskedForTheOutcome) {
  for (const bool silent : {true, false}) {
    PendingCommand check = Command(1, kRead);
    check.purpose = Purpose::kOutcomeCheck;
    check.about = NumberedId(50);
    check.about_silent = silent;
    check.about_boot_id = silent ? kDriverBoot + 1 : kDriverBoot;
    check.begin_by = now_.mono + 60 * kSecond;
    Routed(check);
    EXPECT_EQ(listener_.sent.back().kind, Order::KIND_EXECUTE) << silent;
    On(Status(900, S::STATE_SUCCEEDED));
  }
  EXPECT_THAT(listener_.ended, SizeIs(2));
}

TEST_F(DeviceQueueTest, WhatNothingCanVerifyEnds) {
  PendingCommand check = Command(1);
  check.purpose = Purpose::kOutcomeCheck;
  check.operation = nullptr;
  Routed(check);
  ASSERT_THAT(listener_.ended, SizeIs(1));
  EXPECT_EQ(Outcome().state, S::STATE_FAILED);
  EXPECT_THAT(listener_.sent, IsEmpty());
}

}  // namespace
}  // namespace axlecast
