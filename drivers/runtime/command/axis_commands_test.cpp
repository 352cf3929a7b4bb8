#include <gmock/gmock.h>
#include <axlecast/command_status_t.hpp>
#include <axlecast/position_t.hpp>
#include <cmath>

#include "drivers/runtime/command/axis_commands.h"
#include "drivers/runtime/command/operations_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using Status = command_status_t;

constexpr AlarmSpec kBattery = {6, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_ERROR, "battery_error",
                                ""};

class AlarmOrderTest : public OperationsTest {
 protected:
  using OperationsTest::OperationsTest;
  void Battery(bool present) {
    channel_.OnAlarm(kBattery, present ? AlarmState::kLive : AlarmState::kAbsent, clock_.Now());
  }
  std::int64_t Utime() { return time_.Utime(clock_.Now()); }
};

TEST_F(AlarmOrderTest, AcknowledgesOnceAndOnlyWhatIsListed) {
  driver_status_t answer = Do(MakeOrder("acknowledge_alarm", {{"alarm", "battery_error"}}));
  EXPECT_EQ(answer.reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_THAT(answer.text, HasSubstr("battery_error is not listed"));
  Battery(true);
  answer = Do(MakeOrder("acknowledge_alarm", {{"alarm", "battery_error"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.verified, 1);
  ASSERT_EQ(answer.n_changes, 1);
  EXPECT_EQ(answer.changes[0].before, "present");
  EXPECT_EQ(answer.changes[0].after, "acknowledged");
  EXPECT_TRUE(channel_.alarms().Look("battery_error").acknowledged);
  answer = Do(MakeOrder("acknowledge_alarm", {{"alarm", "battery_error"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.changes[0].before, "acknowledged");
}

TEST_F(AlarmOrderTest, ShelvesForATimeUpToThePresentSeverity) {
  Battery(true);
  const driver_status_t answer = Do(MakeOrder("shelve_alarm", {{"alarm", "battery_error"}, {"seconds", "60"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  const AlarmShelves::Shelf* shelf = channel_.alarms().shelves().Find("battery_error");
  ASSERT_NE(shelf, nullptr);
  EXPECT_EQ(shelf->up_to, alarm_entry_t::SEVERITY_ERROR);
  EXPECT_NEAR(static_cast<double>(shelf->until_utime - Utime()), 60e6, 1e6);
  ASSERT_EQ(answer.n_changes, 3);
  EXPECT_EQ(answer.changes[1].after, std::to_string(shelf->until_utime));
  EXPECT_EQ(answer.changes[2].after, "error");
  EXPECT_EQ(Do(MakeOrder("unshelve_alarm", {{"alarm", "battery_error"}})).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(channel_.alarms().shelves().Find("battery_error"), nullptr);
  EXPECT_EQ(Do(MakeOrder("unshelve_alarm", {{"alarm", "battery_error"}})).reason_code, Status::REASON_BAD_ARGUMENT);
}

TEST_F(AlarmOrderTest, RefusesWhatNobodyCanMean) {
  Battery(true);
  const std::string late = std::to_string(Utime() + AlarmShelves::kLongestUs + 60'000'000);
  const std::vector<std::vector<argument_t>> wrong = {
      {{"alarm", "battery_error"}},
      {{"alarm", "battery_error"}, {"seconds", "60"}, {"until", "1"}},
      {{"alarm", "battery_error"}, {"seconds", "0"}},
      {{"alarm", "battery_error"}, {"seconds", "86401"}},
      {{"alarm", "battery_error"}, {"seconds", "1.5"}},
      {{"alarm", "battery_error"}, {"until", "1"}},
      {{"alarm", "battery_error"}, {"until", late}},
      {{"alarm", "battery_error"}, {"seconds", "60"}, {"up_to", "bad"}},
      {{"alarm", "other"}, {"seconds", "60"}},
      {{"alarm", ""}, {"seconds", "60"}},
      {{"alarm", "a name that is far too long"}, {"seconds", "60"}},
      {{"alarm", "two words"}, {"seconds", "60"}},
  };
  for (const auto& arguments : wrong) {
    const driver_status_t answer = Do(MakeOrder("shelve_alarm", arguments));
    EXPECT_EQ(answer.reason_code, Status::REASON_BAD_ARGUMENT) << answer.text;
  }
  EXPECT_EQ(channel_.alarms().shelves().Find("battery_error"), nullptr);
}

TEST_F(AlarmOrderTest, ARestartedDriverIsGivenBackWhatItHasNotSeenYet) {
  const std::string until = std::to_string(Utime() + 60'000'000);
  EXPECT_EQ(Do(MakeOrder("restore_acknowledgement", {{"alarm", "battery_error"}})).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(Do(MakeOrder("shelve_alarm", {{"alarm", "other"}, {"until", until}, {"up_to", "warning"}})).state,
            Status::STATE_SUCCEEDED);
  EXPECT_EQ(channel_.alarms().Acknowledged(), std::vector<std::string>{"battery_error"});
  Battery(true);
  EXPECT_TRUE(channel_.alarms().Look("battery_error").acknowledged);
  EXPECT_NE(channel_.alarms().shelves().Find("other"), nullptr);
}

using ::testing::HasSubstr;

TEST_F(OperationsTest, SetDatumMakesThePresentPositionReadTheValue) {
  bus_.devices[0].unit = position_t::UNIT_COUNT;
  Online(1'000);
  const std::int32_t epoch = channel_.summary().datum_epoch;
  const driver_status_t answer = Do(MakeOrder("set_datum", {{"value", "0"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.verified, 1);
  EXPECT_EQ(answer.epoch_after, epoch + 1);
  EXPECT_NEAR(channel_.summary().value, 0, 1e-9);
  ASSERT_EQ(answer.n_changes, 3);
  EXPECT_EQ(answer.changes[0].key, "value");
  EXPECT_EQ(answer.changes[0].after, "0");
  EXPECT_EQ(answer.changes[1].key, "datum_counts");
  EXPECT_EQ(answer.changes[1].before, "none");
  EXPECT_EQ(answer.changes[1].after, std::to_string(channel_.summary().datum->counts));
  EXPECT_EQ(answer.changes[2].key, "identity");
  EXPECT_EQ(answer.changes[2].after, "");
  EXPECT_EQ(channel_.summary().datum->unix_us, time_.Utime(clock_.Now()));
}

TEST_F(OperationsTest, ADatumOfAnEarlierDayComesBackAsOld) {
  Online(1'000);
  const std::int64_t earlier = time_.Utime(clock_.Now()) - 86'400'000'000;
  const driver_status_t answer = Do(MakeOrder("set_datum", {{"counts", "10"}, {"utime", std::to_string(earlier)}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(channel_.summary().datum, (Reference::Datum{10, earlier}));
  for (const char* text : {"", "1.5", "-1", "x", "99999999999999999999"}) {
    EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", "1"}, {"utime", text}})).reason_code,
              Status::REASON_BAD_ARGUMENT)
        << text;
  }
}

TEST_F(OperationsTest, ADatumOfAnotherEncoderIsRefused) {
  Online();
  const std::vector<argument_t> datum = {{"counts", "10"}, {"identity", "17 SN0042"}};
  driver_status_t answer = Do(MakeOrder("set_datum", datum));
  EXPECT_EQ(answer.reason_code, Status::REASON_DEVICE_OFFLINE);
  EXPECT_THAT(answer.text, HasSubstr("not reported its identity yet"));
  channel_.OnIdentity(17, "SN0043", "");
  answer = Do(MakeOrder("set_datum", datum));
  EXPECT_EQ(answer.reason_code, Status::REASON_WRONG_IDENTITY);
  EXPECT_THAT(answer.text, HasSubstr("is 17 SN0043, and the datum is for 17 SN0042"));
  EXPECT_FALSE(channel_.summary().datum);
  channel_.OnIdentity(17, "SN0042", "");
  answer = Do(MakeOrder("set_datum", datum));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.changes.at(2).after, "17 SN0042");
}

TEST_F(OperationsTest, AClearedDatumIsNone) {
  Online(1'000);
  EXPECT_EQ(Do(MakeOrder("clear_datum")).reason_code, Status::REASON_NO_DATUM);
  Send(MakeOrder("set_datum", {{"counts", "400"}}));
  const std::int32_t epoch = channel_.summary().datum_epoch;
  const driver_status_t answer = Do(MakeOrder("clear_datum"));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.verified, 1);
  EXPECT_EQ(answer.epoch_after, epoch + 1);
  EXPECT_EQ(answer.changes.at(1).before, "400");
  EXPECT_EQ(answer.changes.at(1).after, "none");
  EXPECT_FALSE(channel_.summary().datum);
  clock_.Advance(kMillisecond);
  channel_.OnSample({.at = {clock_.Now(), clock_.Now()}, .counts = 1'000});
  const position_t position = sink_.All<position_t>("POSITION/axis1").back();
  EXPECT_EQ(position.counts, 1'000);
  EXPECT_EQ(position.flags & position_t::FLAG_REFERENCED, 0);
}

class FileDatumTest : public OperationsTest {
 protected:
  static BusConfig Bus() {
    BusConfig bus = PolledBus(1);
    bus.devices[0].datum_counts = 70;
    return bus;
  }
  FileDatumTest() : OperationsTest(Bus()) {}
};

TEST_F(FileDatumTest, TheFilesDatumCannotBeClearedAndComesBack) {
  Online(1'000);
  driver_status_t answer = Do(MakeOrder("clear_datum"));
  EXPECT_EQ(answer.reason_code, Status::REASON_NOT_PERMITTED);
  EXPECT_THAT(answer.text, HasSubstr("70 counts, is set in the machine's file"));
  Send(MakeOrder("set_datum", {{"counts", "400"}}));
  answer = Do(MakeOrder("clear_datum"));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.changes.at(1).after, "70");
  EXPECT_EQ(channel_.summary().datum->counts, 70);
}

TEST_F(OperationsTest, SetDatumTakesCountsEvenBeforeTheDeviceAnswers) {
  const driver_status_t answer = Do(MakeOrder("set_datum", {{"counts", "-12345"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", "1"}})).reason_code, Status::REASON_DEVICE_OFFLINE);
}

TEST_F(OperationsTest, SetDatumRefusesWhatIsNoNumber) {
  Online();
  for (const char* text : {"", "x", "1x", "nan", "inf", "1e300", " 1"}) {
    EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", text}})).reason_code, Status::REASON_BAD_ARGUMENT) << text;
  }
  for (const char* text : {"1.5", "9223372036854775807", "--1"}) {
    EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", text}})).reason_code, Status::REASON_BAD_ARGUMENT) << text;
  }
  EXPECT_EQ(Do(MakeOrder("set_datum")).reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", "1"}, {"counts", "1"}})).reason_code, Status::REASON_BAD_ARGUMENT);
}

TEST_F(OperationsTest, TheBridgeTellsThatTheReferenceWasLost) {
  Online();
  EXPECT_EQ(Do(MakeOrder("mark_reference_lost")).state, Status::STATE_SUCCEEDED);
  EXPECT_TRUE(channel_.summary().reference_lost);
}

// ---- the texts and changes that an operator reads ----

class AlarmCommandTextTest : public AlarmOrderTest {
 protected:
  driver_status_t Prepare(const std::string& operation, const std::vector<argument_t>& arguments) {
    driver_order_t order = MakeOrder(operation, arguments);
    order.kind = driver_order_t::KIND_PREPARE;
    return Do(order);
  }
};

TEST_F(AlarmCommandTextTest, AnAcknowledgementStatesWhetherTheAlarmIsStillPresent) {
  bus_.devices[0].alarm_stays_from = alarm_entry_t::SEVERITY_WARNING;
  Battery(true);
  EXPECT_EQ(Prepare("acknowledge_alarm", {{"alarm", "battery_error"}}).text,
            "battery_error would be acknowledged; it is still present");
  EXPECT_FALSE(channel_.alarms().Look("battery_error").acknowledged) << "nothing was done";
  EXPECT_EQ(Do(MakeOrder("acknowledge_alarm", {{"alarm", "battery_error"}})).text,
            "battery_error is acknowledged; it is still present");
  EXPECT_EQ(Do(MakeOrder("acknowledge_alarm", {{"alarm", "battery_error"}})).text,
            "battery_error was acknowledged before");
}

TEST_F(AlarmCommandTextTest, WhatIsNotListedIsNamedWithWhatIs) {
  EXPECT_THAT(Do(MakeOrder("acknowledge_alarm", {{"alarm", "other"}})).text, HasSubstr("there is no alarm"));
  EXPECT_THAT(Do(MakeOrder("shelve_alarm", {{"alarm", "other"}, {"seconds", "60"}})).text,
              HasSubstr("there is no alarm; to shelve it before it comes, give up_to"));
  Battery(true);
  EXPECT_THAT(Do(MakeOrder("acknowledge_alarm", {{"alarm", "other"}})).text, HasSubstr("there are battery_error"));
  EXPECT_THAT(Do(MakeOrder("shelve_alarm", {{"alarm", "other"}, {"seconds", "60"}})).text,
              HasSubstr("there are battery_error"));
}

TEST_F(AlarmCommandTextTest, ShelvingStatesTheTimeAndTheSeverity) {
  Battery(true);
  const driver_status_t would = Prepare("shelve_alarm", {{"alarm", "battery_error"}, {"seconds", "86400"}});
  EXPECT_EQ(would.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(would.text, "battery_error would be shelved for 86400 s, up to severity error");
  EXPECT_EQ(channel_.alarms().shelves().Find("battery_error"), nullptr);
  const driver_status_t done = Do(MakeOrder("shelve_alarm", {{"alarm", "battery_error"}, {"seconds", "1"}}));
  EXPECT_EQ(done.text, "battery_error is shelved for 1 s, up to severity error");
  EXPECT_EQ(done.verified, 1);
  EXPECT_EQ(done.changes.at(0).before, "present");
  EXPECT_EQ(done.changes.at(0).after, "shelved");
  const driver_status_t again = Do(MakeOrder("unshelve_alarm", {{"alarm", "battery_error"}}));
  EXPECT_EQ(again.text, "battery_error is unshelved");
  ASSERT_EQ(again.n_changes, 1);
  EXPECT_EQ(again.changes[0].before, "shelved");
  EXPECT_EQ(again.changes[0].after, "present");
}

TEST_F(AlarmCommandTextTest, ShelvingTakesATimeWithinTheNextDay) {
  const auto until = [this](std::int64_t later_us) {
    return Do(MakeOrder("shelve_alarm",
                        {{"alarm", "other"}, {"until", std::to_string(Utime() + later_us)}, {"up_to", "info"}}));
  };
  EXPECT_EQ(until(0).reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_THAT(Last().text, HasSubstr("within the next 86400 s"));
  EXPECT_EQ(until(1).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(until(AlarmShelves::kLongestUs).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(until(AlarmShelves::kLongestUs + 1).reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_EQ(channel_.alarms().shelves().Find("other")->up_to, alarm_entry_t::SEVERITY_INFO);
}

TEST_F(AlarmCommandTextTest, AFullShelfTakesOnlyWhatIsOnItAlready) {
  const auto shelve = [this](std::size_t number) {
    return Do(MakeOrder("shelve_alarm",
                        {{"alarm", "a" + std::to_string(number)}, {"seconds", "60"}, {"up_to", "warning"}}));
  };
  for (std::size_t number = 0; number < AlarmShelves::kMax; ++number) {
    ASSERT_EQ(shelve(number).state, Status::STATE_SUCCEEDED) << number;
  }
  EXPECT_EQ(shelve(AlarmShelves::kMax).reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_THAT(Last().text, HasSubstr("unshelve some first"));
  EXPECT_EQ(shelve(0).state, Status::STATE_SUCCEEDED) << "for another time";
}

TEST_F(AlarmCommandTextTest, AnAcknowledgementOfBeforeIsExpectedForTenSeconds) {
  for (const bool late : {false, true}) {
    const std::string alarm = late ? "late" : "battery_error";
    EXPECT_EQ(Do(MakeOrder("restore_acknowledgement", {{"alarm", alarm}})).text,
              alarm + " is taken as acknowledged before");
    EXPECT_EQ(Last().n_changes, 0);
  }
  EXPECT_EQ(Prepare("restore_acknowledgement", {{"alarm", "x"}}).text, "x would be taken as acknowledged before");
  clock_.Advance(10 * kSecond - kMillisecond);
  Battery(true);
  EXPECT_TRUE(channel_.alarms().Look("battery_error").acknowledged);
  clock_.Advance(kSecond);
  constexpr AlarmSpec kLate = {7, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_ERROR, "late", ""};
  channel_.Tick(clock_.Now());
  channel_.OnAlarm(kLate, AlarmState::kLive, clock_.Now());
  EXPECT_FALSE(channel_.alarms().Look("late").acknowledged);
}

TEST_F(AlarmCommandTextTest, AnAlarmIsOneWordOfAtMost24Bytes) {
  const auto shelve = [this](const std::string& alarm) {
    return Do(MakeOrder("shelve_alarm", {{"alarm", alarm}, {"seconds", "60"}, {"up_to", "warning"}}));
  };
  for (const std::string& alarm :
       {std::string(), std::string("two words"), std::string("all*"), std::string(25, 'a')}) {
    EXPECT_EQ(shelve(alarm).state, Status::STATE_REJECTED) << alarm;
    EXPECT_THAT(Last().text, HasSubstr("alarm is not a name")) << alarm;
    EXPECT_EQ(channel_.alarms().shelves().Find(alarm), nullptr) << alarm;
  }
  EXPECT_EQ(shelve(std::string(24, 'a')).state, Status::STATE_SUCCEEDED);
}

TEST_F(AlarmCommandTextTest, AShelfHasTheTimeAndTheSeverityThatWereGiven) {
  const std::int64_t until = Utime() + 90'000'000;
  const driver_status_t answer =
      Do(MakeOrder("shelve_alarm", {{"alarm", "other"}, {"until", std::to_string(until)}, {"up_to", "warning"}}));
  EXPECT_EQ(answer.text, "other is shelved for 90 s, up to severity warning");
  const AlarmShelves::Shelf* shelf = channel_.alarms().shelves().Find("other");
  ASSERT_NE(shelf, nullptr);
  EXPECT_EQ(shelf->until_utime, until);
  EXPECT_EQ(shelf->up_to, alarm_entry_t::SEVERITY_WARNING);
}

TEST_F(AlarmCommandTextTest, ShelvingStatesHowTheAlarmWasBefore) {
  const auto before = [this](const std::string& alarm) {
    return Prepare("shelve_alarm", {{"alarm", alarm}, {"seconds", "60"}, {"up_to", "warning"}})
        .changes.at(0)
        .before;
  };
  EXPECT_EQ(before("battery_error"), "absent");
  Battery(true);
  EXPECT_EQ(before("battery_error"), "present");
  Send(MakeOrder("acknowledge_alarm", {{"alarm", "battery_error"}}));
  EXPECT_EQ(before("battery_error"), "acknowledged");
}

class StayingAlarmTest : public AlarmOrderTest {
 protected:
  static BusConfig Bus() {
    BusConfig bus = PolledBus(1);
    bus.devices[0].alarm_stays_from = alarm_entry_t::SEVERITY_WARNING;
    return bus;
  }
  StayingAlarmTest() : AlarmOrderTest(Bus()) {}
};

TEST_F(StayingAlarmTest, AnAlarmThatHasGoneIsRemovedByItsAcknowledgement) {
  Battery(true);
  Battery(false);
  const driver_status_t shelved =
      Do(MakeOrder("shelve_alarm", {{"alarm", "battery_error"}, {"seconds", "60"}, {"up_to", "info"}}));
  EXPECT_EQ(shelved.changes.at(0).before, "gone");
  const driver_status_t answer = Do(MakeOrder("acknowledge_alarm", {{"alarm", "battery_error"}}));
  EXPECT_EQ(answer.text, "battery_error is removed from the list: its cause has gone");
  EXPECT_EQ(answer.changes.at(0).before, "gone");
  EXPECT_EQ(answer.changes.at(0).after, "cleared");
  EXPECT_EQ(channel_.alarms().Names(), "");
}

TEST_F(AlarmOrderTest, AnAcknowledgementTakesNoPlaceOnTheShelf) {
  Battery(true);
  for (std::size_t number = 1; number < AlarmShelves::kMax; ++number) {
    Send(
        MakeOrder("shelve_alarm", {{"alarm", "a" + std::to_string(number)}, {"seconds", "60"}, {"up_to", "info"}}));
  }
  EXPECT_EQ(Do(MakeOrder("acknowledge_alarm", {{"alarm", "battery_error"}})).state, Status::STATE_SUCCEEDED);
  EXPECT_FALSE(channel_.alarms().shelves().IsFull());
}

TEST_F(AlarmOrderTest, WhatIsUnshelvedIsNotAcknowledgedByThat) {
  Battery(true);
  Send(MakeOrder("shelve_alarm", {{"alarm", "battery_error"}, {"seconds", "60"}}));
  Send(MakeOrder("unshelve_alarm", {{"alarm", "battery_error"}}));
  EXPECT_FALSE(channel_.alarms().Look("battery_error").acknowledged);
}

TEST_F(OperationsTest, TheTextOfADatumStatesItsCounts) {
  Online(1'000);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", "400"}})).text, "datum set to 400 counts");
  EXPECT_EQ(Do(MakeOrder("clear_datum")).text, "the datum is cleared");
  EXPECT_EQ(Do(MakeOrder("mark_reference_lost")).text, "the reference is marked as lost");
  EXPECT_EQ(Last().verified, 1);
  EXPECT_EQ(Last().n_changes, 0);
}

TEST_F(FileDatumTest, TheTextOfAClearedDatumStatesThatTheFilesIsUsed) {
  Online(1'000);
  Send(MakeOrder("set_datum", {{"counts", "400"}}));
  driver_order_t prepare = MakeOrder("clear_datum");
  prepare.kind = driver_order_t::KIND_PREPARE;
  const driver_status_t would = Do(prepare);
  EXPECT_EQ(would.text, "would clear the datum, 400 counts");
  EXPECT_EQ(would.changes.at(0).after, ValueText((1'000 - 70) / 65'536.0)) << "counted from the datum of the file";
  EXPECT_EQ(channel_.summary().datum->counts, 400);
  const driver_status_t done = Do(MakeOrder("clear_datum"));
  EXPECT_EQ(done.text, "the datum of the machine's file is used again");
  EXPECT_EQ(done.changes.at(0).after, would.changes.at(0).after);
}

TEST_F(OperationsTest, ADatumMayBeAsLargeAsADoubleDistinguishesCounts) {
  Online();
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", "9000000000000000"}})).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", "-9000000000000000"}})).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", "9000000000000002"}})).reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", "1"}, {"utime", "0"}})).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(channel_.summary().datum->unix_us, 0);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", "2"}, {"identity", ""}})).state, Status::STATE_SUCCEEDED)
      << "of any encoder";
}

TEST_F(OperationsTest, AnOlderDatumIsPreparedWithoutAValue) {
  Online(1'000);
  for (const bool dated : {false, true}) {
    std::vector<argument_t> arguments = {{"counts", "400"}};
    if (dated) arguments.push_back({"utime", "1000"});
    driver_order_t order = MakeOrder("set_datum", arguments);
    order.kind = driver_order_t::KIND_PREPARE;
    EXPECT_EQ(Do(order).changes.at(0).after.empty(), dated);
  }
}

TEST(ValueText, AnUnknownValueHasNone) {
  EXPECT_EQ(ValueText(std::nan("")), "");
  EXPECT_EQ(ValueText(1.25), "1.25");
  EXPECT_EQ(ValueText(-3), "-3");
}

}  // namespace
}  // namespace axlecast
