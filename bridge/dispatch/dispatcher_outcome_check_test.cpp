#include "bridge/dispatch/dispatcher_fixture.h"
#include "bridge/dispatch/outcome_check.h"
#include "core/command/commands.h"

namespace axlecast {
namespace {

TEST_F(DispatcherTest, ARestartedDriverLeavesItIndeterminateThenFound) {
  const auto body = Body(1);
  Send(body);
  Report(Orders()[0], S::STATE_RUNNING, {{"count", "4", ""}});
  sink_.Clear();
  Hello(kDriver + 1);
  EXPECT_EQ(Last().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Last().reason_code, S::REASON_DRIVER_RESTARTED);
  EXPECT_EQ(Last().finding, S::FINDING_NONE);
  ASSERT_EQ(Orders().size(), 1u);
  const auto look = Orders()[0];
  EXPECT_EQ(look.driver_boot_id, kDriver + 1);
  EXPECT_EQ(look.operation, "look");
  ASSERT_EQ(look.n_arguments, 1);
  EXPECT_EQ(look.arguments[0].key, "after");
  EXPECT_EQ(look.arguments[0].value, "bump");
  EXPECT_NE(IdOf(look.id), NumberedId(1));
  Report(look, S::STATE_SUCCEEDED, {{"count", "", "5"}, {"finding", "", "reads_as_after"}});
  EXPECT_EQ(Last().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Last().finding, S::FINDING_EFFECT_SEEN);
  EXPECT_EQ(IdOf(Last().id), NumberedId(1));
  EXPECT_EQ(Last().changes[0].after, "5");
  EXPECT_EQ(Last().text, "the driver restarted while it had this order; afterwards: effect_seen");
  EXPECT_EQ(Send(body).finding, S::FINDING_EFFECT_SEEN);
}

TEST_F(DispatcherTest, WithoutAValueFromBeforeAnEffectIsNotClaimed) {
  Send(Body(1));
  Hello(kDriver + 1);
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"count", "", "5"}, {"finding", "", "reads_as_after"}});
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
  EXPECT_NE(Last().text.find("not known"), std::string::npos);
}

TEST_F(DispatcherTest, WhatReadTheSameBeforeTellsNothing) {
  Send(Body(1));
  Report(Orders()[0], S::STATE_RUNNING, {{"count", "5", ""}});
  Hello(kDriver + 1);
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"count", "", "5"}, {"finding", "", "reads_as_after"}});
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
  ASSERT_EQ(Last().n_changes, 1);
  EXPECT_EQ(Last().changes[0].before, "5");
  EXPECT_EQ(Last().changes[0].after, "5");

  Send(Body(2));
  Report(Orders().back(), S::STATE_RUNNING, {{"count", "5", ""}});
  Hello(kDriver + 2);
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"count", "", "6"}, {"finding", "", "reads_as_after"}});
  EXPECT_EQ(Last().finding, S::FINDING_EFFECT_SEEN);
}

// A position that flickers about 0 reads differently each time: only the driver could compare it with the reading before.
TEST_F(DispatcherTest, TheDriversJudgementOfBeforeDecides) {
  Send(Body(1));
  Report(Orders()[0], S::STATE_RUNNING, {{"count", "5", ""}, {"finding", "reads_as_after", ""}});
  Hello(kDriver + 1);
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"count", "", "6"}, {"finding", "", "reads_as_after"}});
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
  EXPECT_NE(Last().text.find("it read the same before"), std::string::npos);

  Send(Body(2));
  Report(Orders().back(), S::STATE_RUNNING, {{"finding", "no_effect_seen", ""}});
  Hello(kDriver + 2);
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"finding", "", "reads_as_after"}});
  EXPECT_EQ(Last().finding, S::FINDING_EFFECT_SEEN);
}

TEST_F(DispatcherTest, TheFinderIsToldWhatWasOrdered) {
  auto body = Body(1, "mark");
  body.arguments = {{"note", "A1 05"}, {"page", "3"}};
  body.n_arguments = 2;
  Send(body);
  Hello(kDriver + 1);
  EXPECT_EQ(Orders().back().arguments[0].value, "mark note=A1 05 page=3");
  Report(Orders().back(), S::STATE_SUCCEEDED);

  const CommandId id = NumberedId(2);
  std::copy(id.begin(), id.end(), std::begin(body.id));
  body.arguments[0].value = "x page=4";  // could be read in two ways
  Send(body);
  Hello(kDriver + 2);
  EXPECT_EQ(Orders().back().operation, "look");
  EXPECT_EQ(Orders().back().n_arguments, 0);
}

TEST_F(DispatcherTest, NothingElseIsDoneToTheDeviceBeforeTheFinding) {
  Send(Body(1));
  Send(Body(2));
  sink_.Clear();
  Hello(kDriver + 1);
  ASSERT_EQ(Orders().size(), 1u);
  Report(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(sink_.All<S>("COMMAND_STATUS")[1].finding, S::FINDING_CANNOT_TELL);  // no change `finding`
  ASSERT_EQ(Orders().size(), 2u);
  EXPECT_EQ(IdOf(Orders()[1].id), NumberedId(2));
}

// An encoder whose memory is busy does not return its cells: it is read again during the whole time promised.
TEST_F(DispatcherTest, ALookThatCannotReadIsRepeatedUntilItsTimeIsOver) {
  Send(Body(1));
  Report(Orders()[0], S::STATE_RUNNING, {{"count", "4", ""}});
  Hello(kDriver + 1);
  for (int look = 0; look < 3; ++look) {
    const std::size_t orders = Orders().size();
    ReportFailure(Orders().back(), S::REASON_NO_REPLY);
    EXPECT_EQ(Last().finding, S::FINDING_NONE);
    PassWithDriver(kCheckAgain + 100 * kMillisecond);
    ASSERT_GT(Orders().size(), orders) << look;
    EXPECT_EQ(Orders().back().operation, "look");
  }
  Report(Orders().back(), S::STATE_SUCCEEDED, {{"count", "", "5"}, {"finding", "", "reads_as_after"}});
  EXPECT_EQ(Last().finding, S::FINDING_EFFECT_SEEN);
}

TEST_F(DispatcherTest, ALookThatNeverReadsEndsWithItsTime) {
  Send(Body(1));
  Hello(kDriver + 1);
  const MonoNs begun = now_.mono;
  while (Last().finding == S::FINDING_NONE && now_.mono < begun + 2 * Dispatcher::kCheckWithin) {
    ReportFailure(Orders().back(), S::REASON_NO_REPLY);
    PassWithDriver(kCheckAgain + 100 * kMillisecond);
  }
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
  EXPECT_GT(now_.mono, begun + Dispatcher::kCheckWithin - 2 * kSecond);
  EXPECT_LE(now_.mono, begun + Dispatcher::kCheckWithin + kSecond);
}

TEST_F(DispatcherTest, WhatADeviceRefusesToTellIsNotLookedForAgain) {
  Send(Body(1));
  Hello(kDriver + 1);
  ReportFailure(Orders().back(), S::REASON_DEVICE_REFUSED);
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
}

TEST_F(DispatcherTest, WhatNothingCanFindIsSaidAtOnce) {
  auto body = Body(1, "write");
  body.arguments = {{"address", "3"}, {"bytes", "A1 05"}};
  body.n_arguments = 2;
  Send(body);
  Hello(kDriver + 1);
  EXPECT_EQ(Last().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
}

TEST_F(DispatcherTest, ADriverThatNeverComesBackIsSaidToo) {
  Send(Body(1));
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  EXPECT_EQ(Last().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Last().reason_code, S::REASON_DRIVER_SILENT);
  EXPECT_EQ(Last().finding, S::FINDING_NONE);
  Pass(Dispatcher::kCheckWithin + 20 * kMillisecond);
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
  EXPECT_EQ(Last().state, S::STATE_INDETERMINATE);
}

TEST_F(DispatcherTest, ADriverThatWasSilentIsAskedWhenItIsHeardAgain) {
  Send(Body(1));
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  sink_.Clear();
  Hello(kDriver);
  ASSERT_EQ(Orders().size(), 1u);
  EXPECT_EQ(Orders()[0].kind, driver_order_t::KIND_QUERY);
  EXPECT_EQ(IdOf(Orders()[0].id), NumberedId(1));
  Report(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().state, S::STATE_INDETERMINATE);
  EXPECT_EQ(Last().finding, S::FINDING_EFFECT_SEEN);
}

// The driver has the new datum, and loses it when it ends: the journal must have it by then.
TEST_F(DispatcherTest, ADatumThatASilentDriverHasSetIsKept) {
  command_body_t body = Body(1, "set_datum");
  body.arguments = {{"counts", "73"}, {"utime", "5000"}};
  body.n_arguments = 2;
  body.reason = "homed";
  Send(body);
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  sink_.Clear();
  Hello(kDriver);
  Report(Orders().at(0), S::STATE_SUCCEEDED, {{"datum_counts", "", "73"}});
  EXPECT_EQ(Last().finding, S::FINDING_EFFECT_SEEN);
  const auto datum = store_.Find("axis1").datum;
  ASSERT_TRUE(datum);
  EXPECT_EQ(datum->counts, 73);
  EXPECT_EQ(datum->command, NumberedId(1));
  EXPECT_EQ(datum->utime, 5'000);
  EXPECT_EQ(datum->who, "unsigned");
  EXPECT_EQ(datum->reason, "homed");
}

TEST_F(DispatcherTest, ADatumThatASilentDriverCouldNotVerifyIsKeptToo) {
  command_body_t body = Body(1, "set_datum");
  body.arguments = {{"counts", "73"}};
  body.n_arguments = 1;
  Send(body);
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  sink_.Clear();
  Hello(kDriver);
  Report(Orders().at(0), S::STATE_SUCCEEDED, {{"datum_counts", "", "73"}}, 0, false);
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
  EXPECT_TRUE(store_.Find("axis1").datum);
}

// The text of the driver is stated once, and behind it what the journal could not take.
TEST_F(DispatcherTest, ADatumOfASilentDriverThatTheJournalCannotKeepIsNamed) {
  command_body_t body = Body(1, "set_datum");
  body.arguments = {{"counts", "73"}};
  body.n_arguments = 1;
  Send(body);
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  sink_.Clear();
  journal_->Stall();
  Pass(JournalQueue::kSlow + 20 * kMillisecond);
  for (std::uint32_t number = 2; journal_->waiting() < JournalQueue::kMaxWaiting; ++number) {
    Hello(kDriver, number % 2 == 0);  // the reference is lost and restored: a change of the device each time
  }
  driver_status_t done{};
  done.kind = driver_status_t::KIND_STATUS;
  const CommandId id = NumberedId(1);
  std::copy(id.begin(), id.end(), std::begin(done.id));
  done.state = S::STATE_SUCCEEDED;
  done.verified = 1;
  done.text = "datum set";
  done.changes = {{"datum_counts", "", "73"}};
  done.n_changes = 1;
  FromDriver(done);
  const std::string text = Last().text;
  EXPECT_NE(text.find("the journal could not keep it"), std::string::npos) << text;
  EXPECT_EQ(text.find("datum set"), text.rfind("datum set")) << text;
}

TEST_F(DispatcherTest, AnExchangeThatASilentDriverHasTakenIsKept) {
  ASSERT_TRUE(store_.Apply("axis1", IdentityChanged{"17 A"}));
  ASSERT_TRUE(store_.Apply("axis1", DatumRecord{.counts = 5, .utime = 1, .identity = "17 A"}));
  RestartBridge(kBoot);
  driver_device_t axis = OnlineDevice("axis1");
  axis.identity = "17 B";
  axis.has_position = 1;
  HelloWith(kDriver, axis);
  Send(Body(1, "accept_exchange"));
  ASSERT_FALSE(Orders().empty());
  EXPECT_EQ(Orders().back().operation, "clear_datum");
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  sink_.Clear();
  HelloWith(kDriver, axis);
  ASSERT_FALSE(Orders().empty());
  Report(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(store_.Find("axis1").identity, "17 B");
}

TEST_F(DispatcherTest, ADatumThatASilentDriverHasClearedIsVoid) {
  ASSERT_TRUE(store_.Apply("axis1", DatumRecord{.counts = 5}));
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  sink_.Clear();
  command_body_t body = Body(1, "clear_datum");
  body.bridge_boot_id = kBoot + 1;
  Send(body);
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  sink_.Clear();
  Hello(kDriver);
  Report(Orders().at(0), S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().finding, S::FINDING_EFFECT_SEEN);
  EXPECT_FALSE(store_.Find("axis1").datum);
}

TEST_F(DispatcherTest, AnAlarmThatASilentDriverHasShelvedIsKept) {
  command_body_t body = Body(1, "shelve_alarm");
  body.arguments = {{"alarm", "battery_alarm"}, {"seconds", "60"}};
  body.n_arguments = 2;
  Send(body);
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  sink_.Clear();
  Hello(kDriver);
  Report(Orders().at(0), S::STATE_SUCCEEDED, {{"until", "", std::to_string(now_.utime + 60'000'000)}});
  EXPECT_EQ(store_.Marks("axis1").size(), 1U);
}

// What the driver itself could not verify is no effect that was seen.
TEST_F(DispatcherTest, WhatTheSilentDriverCouldNotVerifyIsNoEffectSeen) {
  Send(Body(1));
  Pass(DeviceQueue::kSilentAfter + 20 * kMillisecond);
  sink_.Clear();
  Hello(kDriver);
  Report(Orders()[0], S::STATE_SUCCEEDED, {}, 0, false);
  EXPECT_EQ(Last().finding, S::FINDING_CANNOT_TELL);
}

}  // namespace
}  // namespace axlecast
