#include "bridge/dispatch/dispatcher_fixture.h"
#include "core/command/commands.h"

namespace axlecast {
namespace {

// What the bridge does while the disk of its journal does not answer.
class DispatcherStallTest : public DispatcherTest {
 protected:
  void PassStalled(MonoNs time) { PassWithDriver(time); }
  S Of(std::uint32_t number) const {
    S found{};
    for (const S& status : sink_.All<S>("COMMAND_STATUS")) {
      if (IdOf(status.id) == NumberedId(number)) found = status;
    }
    return found;
  }
  std::vector<std::string> Ordered() const {
    std::vector<std::string> names;
    for (const driver_order_t& order : Orders()) {
      if (names.empty() || names.back() != order.operation) names.push_back(order.operation);
    }
    return names;
  }
};

TEST_F(DispatcherStallTest, NothingIsToldOrSentBeforeTheAcceptanceIsOnTheDisk) {
  journal_->Stall();
  const auto message = Encoded(EnvelopeOf(Body(1)));
  bridge_->OnCommand(message, now_);
  Pass(20 * kMillisecond);
  bridge_->OnCommand(message, now_);  // the client repeats it
  EXPECT_EQ(Statuses(), 0u);
  EXPECT_TRUE(Orders().empty());
  journal_->Recover();
  Step(kMillisecond);
  EXPECT_EQ(Of(1).state, S::STATE_ROUTED);
  EXPECT_EQ(Ordered(), (std::vector<std::string>{"bump"}));
}

TEST_F(DispatcherStallTest, AnUrgentCommandPassesAStalledDisk) {
  journal_->Stall();
  Send(Body(1));
  Send(Body(2, "halt"));
  Pass(150 * kMillisecond);
  EXPECT_EQ(Ordered(), (std::vector<std::string>{"halt"}));
  Report(Orders().back(), S::STATE_SUCCEEDED);
  PassStalled(2 * kSecond);
  EXPECT_EQ(Of(2).state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Of(2).is_final, 1);
  sink_.Clear();
  Send(Body(3, "halt"));
  EXPECT_EQ(Ordered(), (std::vector<std::string>{"halt"})) << "once the disk is known to be slow, at once";
}

TEST_F(DispatcherStallTest, AReadPassesACommandThatWaitsForTheDisk) {
  journal_->Stall();
  Send(Body(1));
  Send(Body(2, "look"));
  EXPECT_TRUE(Orders().empty()) << "in the order of arrival, while the disk is not slow";
  Pass(DeviceQueue::kOvertaken + 20 * kMillisecond);
  EXPECT_EQ(Ordered(), (std::vector<std::string>{"look"}));
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(Of(2).state, S::STATE_SUCCEEDED);
}

TEST_F(DispatcherStallTest, AfterASecondCommandsAreRefusedWithTheReason) {
  journal_->Stall();
  auto body = Body(1);
  body.valid_ms = 60'000;
  Send(body);
  PassStalled(JournalQueue::kStalled + 200 * kMillisecond);
  EXPECT_EQ(Of(1).state, S::STATE_REJECTED);
  EXPECT_EQ(Of(1).reason_code, S::REASON_JOURNAL);
  EXPECT_NE(Of(1).text.find("its disk has not answered for 1."), std::string::npos) << Of(1).text;
  EXPECT_EQ(Send(Body(2)).reason_code, S::REASON_JOURNAL);
  EXPECT_NE(ErrorText(bridge_->CheckJournal(now_.mono)).find("has not answered"), std::string::npos);
  EXPECT_TRUE(Orders().empty());
  journal_->Recover();
  Step(10 * kMillisecond);
  EXPECT_TRUE(Orders().empty()) << "what was refused is not done when the disk recovers";
  EXPECT_EQ(store_.Find(NumberedId(1))->state, S::STATE_REJECTED);
  EXPECT_EQ(ErrorText(bridge_->CheckJournal(now_.mono)), "");
  EXPECT_EQ(Send(Body(3)).state, S::STATE_ROUTED);
}

TEST_F(DispatcherStallTest, NothingIsSentBeforeThatItIsRoutedIsOnTheDisk) {
  Send(Body(1));
  Send(Body(2));
  const driver_order_t first = Orders().back();
  sink_.Clear();
  journal_->Stall();
  Report(first, S::STATE_SUCCEEDED);
  EXPECT_TRUE(Orders().empty());
  EXPECT_NE(Of(1).is_final, 1) << "an outcome is published when it is on the disk";
  journal_->Recover();
  Step(kMillisecond);
  EXPECT_EQ(Of(1).state, S::STATE_SUCCEEDED);
  ASSERT_EQ(Ordered(), (std::vector<std::string>{"bump"}));
  EXPECT_EQ(IdOf(Orders().back().id), NumberedId(2));
}

TEST_F(DispatcherStallTest, ADriverThatRestartsBeforeItIsSentHasNothingDone) {
  Send(Body(1));
  Send(Body(2));
  const driver_order_t first = Orders().back();
  sink_.Clear();
  journal_->Stall();
  Report(first, S::STATE_SUCCEEDED);
  Hello(kDriver + 1);
  journal_->Recover();
  Step(kMillisecond);
  EXPECT_EQ(Of(2).state, S::STATE_REJECTED);
  EXPECT_EQ(Of(2).reason_code, S::REASON_DRIVER_RESTARTED);
  EXPECT_TRUE(Orders().empty());
}

TEST_F(DispatcherStallTest, AnOutcomeIsToldAfterASecondAllTheSame) {
  Send(Body(1));
  journal_->Stall();
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_NE(Of(1).is_final, 1);
  EXPECT_NE(SendAs(Body(1), command_body_t::MODE_QUERY).is_final, 1);
  PassStalled(JournalQueue::kStalled + 200 * kMillisecond);
  EXPECT_EQ(Of(1).state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Of(1).is_final, 1);
  EXPECT_NE(Of(1).text.find("the journal has not noted it"), std::string::npos)
      << "after a power failure, the next bridge may report another outcome";
  journal_->Recover();
  Send(Body(2));
  Report(Orders().back(), S::STATE_SUCCEEDED);
  Step(10 * kMillisecond);
  EXPECT_EQ(Of(2).is_final, 1);
  EXPECT_EQ(Of(2).text.find("not noted"), std::string::npos) << Of(2).text;
}

TEST_F(DispatcherStallTest, AClientLearnsOfTheBridgeButNotThatItsCommandIsUnknown) {
  journal_->Stall();
  Step(10 * kMillisecond);
  SendAs(Body(9), command_body_t::MODE_QUERY);
  Pass(JournalQueue::kSlow + 20 * kMillisecond);
  EXPECT_EQ(Of(9).state, S::STATE_UNKNOWN);
  EXPECT_EQ(Of(9).boot_id, kBoot);
  EXPECT_EQ(Of(9).reason_code, S::REASON_JOURNAL) << "so that nobody takes it for a command that never came";
  journal_->Recover();
  Step(10 * kMillisecond);
  EXPECT_EQ(SendAs(Body(9), command_body_t::MODE_QUERY).reason_code, S::REASON_NONE);
}

TEST_F(DispatcherStallTest, WhoAsksWhileTheAcceptanceIsNotOnTheDiskLearnsNothingOfIt) {
  journal_->Stall();
  Send(Body(1));
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_QUERY).reason_code, S::REASON_JOURNAL);
  EXPECT_EQ(Last().state, S::STATE_UNKNOWN);
  sink_.Clear();
  SendAs(Body(1), command_body_t::MODE_CANCEL);
  EXPECT_EQ(Of(1).reason_code, S::REASON_JOURNAL);
  EXPECT_EQ(Of(1).state, S::STATE_UNKNOWN);
}

TEST_F(DispatcherStallTest, WhoAsksWhileTheDiskIsSlowIsAnsweredAtOnce) {
  journal_->Stall();
  Step(10 * kMillisecond);
  Pass(JournalQueue::kSlow + 20 * kMillisecond);
  SendAs(Body(9), command_body_t::MODE_QUERY);
  EXPECT_EQ(Of(9).state, S::STATE_UNKNOWN);
  EXPECT_EQ(Of(9).reason_code, S::REASON_JOURNAL);
}

TEST_F(DispatcherStallTest, AFullJournalTakesNoFurtherCommand) {
  journal_->Stall();
  Send(Body(1, "halt"));
  Pass(60 * kMillisecond);
  ASSERT_FALSE(Orders().empty());
  const driver_order_t order = Orders().back();
  int progress = 0;
  const auto run = [&] {
    driver_status_t status{};
    status.kind = driver_status_t::KIND_STATUS;
    std::copy(std::begin(order.id), std::end(order.id), std::begin(status.id));
    status.state = S::STATE_RUNNING;
    status.text = std::to_string(++progress);
    FromDriver(status);
  };
  while (journal_->waiting() < JournalQueue::kMaxWaiting / 2 && progress < 2'000) run();
  ASSERT_EQ(journal_->waiting(), JournalQueue::kMaxWaiting / 2);
  run();
  EXPECT_EQ(Of(1).text, std::to_string(progress)) << "it is published";
  EXPECT_EQ(journal_->waiting(), JournalQueue::kMaxWaiting / 2) << "the other half of the room is for commands";
  Report(order, S::STATE_SUCCEEDED);
  for (std::uint32_t number = 2; journal_->waiting() < JournalQueue::kMaxWaiting; ++number) {
    sink_.Clear();
    Send(Body(number, "halt"));
    ASSERT_FALSE(Orders().empty());
    Report(Orders().back(), S::STATE_SUCCEEDED);
    ASSERT_LT(number, 2'000U);
  }
  const S refused = Send(Body(5'000));
  EXPECT_EQ(refused.reason_code, S::REASON_JOURNAL);
  EXPECT_NE(refused.text.find("1000 changes wait to be written"), std::string::npos) << refused.text;
}

TEST_F(DispatcherStallTest, AnOutcomeForWhichThereIsNoRoomAtAllIsPublished) {
  journal_->Stall();
  Step(10 * kMillisecond);
  Pass(JournalQueue::kSlow + 20 * kMillisecond);
  for (std::uint32_t number = 1; journal_->waiting() < 2 * JournalQueue::kMaxWaiting; ++number) {
    sink_.Clear();
    Send(Body(number, "halt"));
    ASSERT_FALSE(Orders().empty());
    Report(Orders().back(), S::STATE_SUCCEEDED);
    ASSERT_LT(number, 5'000U);
  }
  sink_.Clear();
  Send(Body(9'000, "halt"));
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(journal_->waiting(), 2 * JournalQueue::kMaxWaiting);
  EXPECT_EQ(Of(9'000).state, S::STATE_SUCCEEDED);
  EXPECT_NE(Of(9'000).text.find("the journal has not noted it"), std::string::npos);
}

TEST_F(DispatcherStallTest, WhatWaitsIsBounded) {
  journal_->Stall();
  Step(10 * kMillisecond);
  for (std::uint32_t number = 1; number <= 5'000; ++number) {
    Send(Body(number, "halt"));
    if (!Orders().empty()) Report(Orders().back(), S::STATE_SUCCEEDED);
    sink_.Clear();
  }
  EXPECT_LE(journal_->waiting(), 2 * JournalQueue::kMaxWaiting + DeviceQueue::kMaxWaiting);
  PassStalled(10 * kSecond);
  EXPECT_LE(journal_->waiting(), 2 * JournalQueue::kMaxWaiting + DeviceQueue::kMaxWaiting);
}

TEST_F(DispatcherStallTest, ABridgeThatStartsOnAStalledDiskServesReadsAndStops) {
  bridge_.reset();
  bridge_ = MakeBridge(kBoot, true);
  Pass(DuplicateBridgeDetector::kListen);
  Hello(kDriver);
  sink_.Clear();
  Send(Body(1, "look"));
  EXPECT_EQ(Ordered(), (std::vector<std::string>{"look"}));
  Send(Body(2, "halt"));
  EXPECT_EQ(Ordered(), (std::vector<std::string>{"look", "halt"}));
  EXPECT_EQ(Send(Body(3)).reason_code, S::REASON_JOURNAL);
}

TEST_F(DispatcherStallTest, WhatTheDiskHasWrittenIsDoneAsSoonAsTheBridgeSettles) {
  journal_->Stall();
  Send(Body(1));
  journal_->Recover();
  now_.mono += 5 * kMillisecond;
  bridge_->Settle(now_);
  EXPECT_EQ(Of(1).state, S::STATE_ROUTED);
  EXPECT_EQ(Of(1).mono_ns, now_.mono);
}

TEST_F(DispatcherStallTest, WhatTheDiskHasWrittenIsNotRefusedByABridgeThatWasLate) {
  journal_->Stall();
  auto body = Body(1);
  body.valid_ms = 60'000;
  Send(body);
  journal_->Recover();
  Step(JournalQueue::kStalled + kMillisecond);
  EXPECT_EQ(Of(1).state, S::STATE_ROUTED);
}

TEST_F(DispatcherStallTest, ACommandThatWasAcceptedIsRefusedIfTheDiskStallsBeforeItIsItsTurn) {
  auto body = Body(1);
  body.valid_ms = 60'000;
  Send(body);
  auto next = Body(2);
  next.valid_ms = 60'000;
  Send(next);
  const driver_order_t first = Orders().back();
  Report(first, S::STATE_RUNNING);
  journal_->Stall();
  PassStalled(JournalQueue::kStalled + 200 * kMillisecond);
  sink_.Clear();
  Report(first, S::STATE_SUCCEEDED);
  EXPECT_EQ(Of(2).state, S::STATE_REJECTED);
  EXPECT_EQ(Of(2).reason_code, S::REASON_JOURNAL);
  EXPECT_TRUE(Orders().empty());
}

TEST_F(DispatcherStallTest, ASlowDiskHoldsUpTheRoutingToo) {
  Send(Body(1));
  Send(Body(2));
  const driver_order_t first = Orders().back();
  Report(first, S::STATE_RUNNING);
  journal_->Stall();
  Pass(JournalQueue::kSlow + 20 * kMillisecond);
  sink_.Clear();
  Report(first, S::STATE_SUCCEEDED);
  EXPECT_TRUE(Orders().empty());
  Send(Body(3));
  EXPECT_EQ(Statuses(), 0U) << "its acceptance is not on the disk yet";
  journal_->Recover();
  Step(kMillisecond);
  EXPECT_EQ(Ordered(), (std::vector<std::string>{"bump"}));
  EXPECT_EQ(IdOf(Orders().back().id), NumberedId(2));
  EXPECT_EQ(Of(3).state, S::STATE_ACCEPTED);
}

TEST_F(DispatcherStallTest, AnUrgentCommandThatIsUnderWayIsNotAcceptedOnceMore) {
  journal_->Stall();
  Send(Body(1, "halt"));
  Pass(150 * kMillisecond);
  Report(Orders().back(), S::STATE_RUNNING);
  journal_->Recover();
  Step(kMillisecond);
  EXPECT_EQ(Of(1).state, S::STATE_RUNNING);
}

TEST_F(DispatcherStallTest, AnOutcomeIsPublishedAfterMoreThanASecondAndOnlyOnce) {
  Send(Body(1));
  const driver_order_t order = Orders().back();
  journal_->Stall();
  sink_.Clear();
  Report(order, S::STATE_SUCCEEDED);
  Step(JournalQueue::kStalled);
  EXPECT_EQ(Statuses(), 0U);
  Step(1);
  EXPECT_EQ(Of(1).state, S::STATE_SUCCEEDED);
  journal_->Recover();
  Step(kMillisecond);
  EXPECT_EQ(Statuses(), 1U);
}

// Urgent commands are sent although the journal is full. Only their outcomes still wait for it.
TEST_F(DispatcherStallTest, OfUrgentCommandsAFullJournalGetsOnlyTheOutcome) {
  journal_->Stall();
  Step(10 * kMillisecond);
  Pass(JournalQueue::kSlow + 20 * kMillisecond);
  std::uint32_t number = 0;
  const auto halt = [&] {
    sink_.Clear();
    Send(Body(++number, "halt"));
    ASSERT_FALSE(Orders().empty());
    Report(Orders().back(), S::STATE_SUCCEEDED);
  };
  while (journal_->waiting() < JournalQueue::kMaxWaiting && !HasFailure()) halt();
  const std::size_t full = journal_->waiting();
  for (int i = 0; i < 50; ++i) halt();
  EXPECT_LE(journal_->waiting(), full + 50);
}

// -- what the bridge remembers

// Nobody can make the bridge store the refusals of commands without end.
TEST_F(DispatcherStallTest, RefusalsAreForgottenWhenTheirCommandsAreNoLongerValid) {
  store_.fails = true;
  for (std::uint32_t number = 1; number <= CommandStore::kMinKept; ++number) {
    Send(Body(number));
    sink_.Clear();
  }
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_QUERY).state, S::STATE_REJECTED);
  Hello(kDriver);
  now_.mono += 2 * kSecond;
  for (std::uint32_t number = 90'000; number < 90'003; ++number) Send(Body(number));
  store_.fails = false;
  Step(10 * kMillisecond);
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_QUERY).state, S::STATE_UNKNOWN);
  EXPECT_EQ(SendAs(Body(90'000), command_body_t::MODE_QUERY).state, S::STATE_REJECTED);
}

TEST_F(DispatcherStallTest, RefusalsForAnAbsentDriverAreForgottenToo) {
  Hello(kDriver, false, driver_status_t::KIND_GOODBYE);
  for (std::uint32_t number = 1; number <= CommandStore::kMinKept; ++number) {
    Send(Body(number));
    sink_.Clear();
  }
  now_.mono += 2 * kSecond;
  for (std::uint32_t number = 90'000; number < 90'003; ++number) Send(Body(number));
  store_.LoseCommands();  // so that the answer is from the bridge's memory
  EXPECT_EQ(SendAs(Body(1), command_body_t::MODE_QUERY).state, S::STATE_UNKNOWN);
  EXPECT_EQ(SendAs(Body(90'000), command_body_t::MODE_QUERY).state, S::STATE_REJECTED);
}

TEST_F(DispatcherStallTest, WhileTooManyCommandsAreValidOnlyReadsAndUrgentCommandsPass) {
  Hello(kDriver, false, driver_status_t::KIND_GOODBYE);
  auto body = Body(0);
  body.valid_ms = 3'600'000;
  for (std::uint32_t number = 1; number <= CommandStore::kMaxKept; ++number) {
    const CommandId id = NumberedId(number);
    std::copy(id.begin(), id.end(), std::begin(body.id));
    Send(body);
    sink_.Clear();
  }
  Hello(kDriver + 1);
  EXPECT_EQ(Send(Body(90'000)).reason_code, S::REASON_QUEUE_FULL);
  EXPECT_NE(Last().text.find("give commands a shorter one"), std::string::npos);
  EXPECT_EQ(Send(Body(90'001, "look")).state, S::STATE_ROUTED);
  EXPECT_EQ(Send(Body(90'002, "halt")).state, S::STATE_ROUTED);
}

// -- a journal that was deleted or rolled back

TEST_F(DispatcherTest, ACapturedCommandDoesNotActAgainWhenTheJournalIsLost) {
  auto body = Body(1);
  body.valid_ms = 3'600'000;
  const auto captured = Encoded(EnvelopeOf(body));
  bridge_->OnCommand(captured, now_);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  store_.LoseCommands();
  Hello(kDriver + 1);  // a driver that does not remember it either
  sink_.Clear();
  bridge_->OnCommand(captured, now_);
  EXPECT_TRUE(Orders().empty());
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED) << "its outcome is answered";
}

TEST_F(DispatcherTest, ManyLaterCommandsDoNotMakeTheBridgeForgetOneThatIsStillValid) {
  auto body = Body(1);
  body.valid_ms = 3'600'000;
  const auto captured = Encoded(EnvelopeOf(body));
  bridge_->OnCommand(captured, now_);
  Report(Orders().back(), S::STATE_SUCCEEDED);
  for (std::uint32_t number = 2; number < 2 + 2 * CommandStore::kMinKept; ++number) {
    sink_.Clear();
    Step(10 * kMillisecond);
    auto other = Body(number);
    other.valid_ms = 1;
    Hello(kDriver);
    Send(other);
    if (!Orders().empty()) Report(Orders().back(), S::STATE_SUCCEEDED);
  }
  store_.LoseCommands();
  Hello(kDriver + 1);
  sink_.Clear();
  bridge_->OnCommand(captured, now_);
  EXPECT_TRUE(Orders().empty());
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
}

}  // namespace
}  // namespace axlecast
