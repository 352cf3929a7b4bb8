#include "bridge/state/device_state.h"

#include "bridge/dispatch/dispatcher_fixture.h"
#include "core/alarm/alarm_table.h"

namespace axlecast {
namespace {

using Kind = AlarmMark::Kind;

// What the bridge keeps of acknowledged and shelved alarms.
class AlarmKeeperTest : public DispatcherTest {
 protected:
  command_body_t About(std::uint32_t number, const std::string& operation, std::vector<argument_t> more = {}) {
    command_body_t body = Body(number, operation);
    more.insert(more.begin(), {"alarm", "battery_error"});
    body.arguments = std::move(more);
    body.n_arguments = static_cast<std::int8_t>(body.arguments.size());
    body.reason = "known";
    return body;
  }
  // The driver's answer to the order that it was given last.
  void Answer(std::vector<change_t> changes) { Report(Orders().back(), S::STATE_SUCCEEDED, std::move(changes)); }
  void Acknowledge() {
    Send(About(1, "acknowledge_alarm"));
    Answer({{"alarm", "present", "acknowledged"}});
  }
  void Shelve(std::uint32_t number = 2, const std::string& alarm = "battery_error", int seconds = 60) {
    command_body_t body = About(number, "shelve_alarm", {{"seconds", std::to_string(seconds)}});
    body.arguments[0].value = alarm;
    Send(body);
    until_ = now_.utime + seconds * INT64_C(1'000'000);
    Answer({{"alarm", "present", "shelved"}, {"until", "", std::to_string(until_)}, {"up_to", "", "error"}});
  }
  void SayAcknowledged(const std::string& names) {
    driver_status_t status{};
    status.kind = driver_status_t::KIND_ACKNOWLEDGED;
    status.device = "axis1";
    status.utime = now_.utime;
    status.text = names;
    FromDriver(status);
  }
  std::vector<std::string> Given() {
    std::vector<std::string> operations;
    for (const driver_order_t& order : Orders()) operations.push_back(order.operation);
    return operations;
  }
  std::int64_t until_ = 0;
};

TEST_F(AlarmKeeperTest, KeepsWhoWhenAndWhyUntilTheAlarmHasGone) {
  Acknowledge();
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  std::vector<AlarmMark> marks = store_.Marks("axis1");
  ASSERT_EQ(marks.size(), 1);
  EXPECT_EQ(marks[0].kind, Kind::kAcknowledged);
  EXPECT_EQ(marks[0].alarm, "battery_error");
  EXPECT_EQ(marks[0].who, "unsigned");
  EXPECT_EQ(marks[0].reason, "known");
  EXPECT_EQ(marks[0].command, NumberedId(1));
  EXPECT_EQ(marks[0].driver_boot_id, kDriver);
  Step(kSecond);
  SayAcknowledged("other battery_error");
  EXPECT_EQ(store_.Marks("axis1").size(), 1);
  SayAcknowledged("other *");  // and more
  EXPECT_EQ(store_.Marks("axis1").size(), 1);
  SayAcknowledged("other");
  EXPECT_TRUE(store_.Marks("axis1").empty());
}

TEST_F(AlarmKeeperTest, WhatADriverReportsBeforeTheJournalIsReadEndsNoMark) {
  Acknowledge();
  bridge_.reset();
  bridge_ = MakeBridge(kBoot, true);
  Pass(DuplicateBridgeDetector::kListen);
  Hello(kDriver);
  SayAcknowledged("");
  journal_->Recover();
  Step(10 * kMillisecond);
  EXPECT_EQ(store_.Marks("axis1").size(), 1);
  Step(kSecond);
  SayAcknowledged("");
  EXPECT_TRUE(store_.Marks("axis1").empty());
}

TEST_F(AlarmKeeperTest, WhoAcknowledgesOnceMoreTakesNobodysPlace) {
  Acknowledge();
  Send(About(3, "acknowledge_alarm"));
  Answer({{"alarm", "acknowledged", "acknowledged"}});
  EXPECT_EQ(store_.Marks("axis1")[0].command, NumberedId(1));
}

TEST_F(AlarmKeeperTest, WhatHadGoneNeedsNoMark) {
  Send(About(1, "acknowledge_alarm"));
  Answer({{"alarm", "gone", "cleared"}});
  EXPECT_TRUE(store_.Marks("axis1").empty());
}

TEST_F(AlarmKeeperTest, ARestartedDriverIsGivenAllBackOnce) {
  Acknowledge();
  Shelve();
  sink_.Clear();
  for (int i = 0; i < 4; ++i) {
    Hello(kDriver + 1);
    Step(10 * kMillisecond);
    if (Orders().size() == static_cast<std::size_t>(i) + 1) Answer({});
  }
  EXPECT_EQ(Given(), (std::vector<std::string>{"restore_acknowledgement", "shelve_alarm"}));
  const driver_order_t shelf = Orders().back();
  EXPECT_EQ(shelf.arguments[1].key, "until");
  EXPECT_EQ(shelf.arguments[1].value, std::to_string(until_));
  EXPECT_EQ(shelf.arguments[2].value, "error");
  for (const AlarmMark& mark : store_.Marks("axis1")) EXPECT_EQ(mark.driver_boot_id, kDriver + 1);
}

TEST_F(AlarmKeeperTest, TheNextBridgeKnowsIt) {
  Acknowledge();
  Shelve();
  RestartBridge(kBoot + 1);
  Hello(kDriver);
  Step(10 * kMillisecond);
  EXPECT_TRUE(Orders().empty());  // this driver knows
  Hello(kDriver + 1);
  Step(10 * kMillisecond);
  EXPECT_EQ(Given().front(), "restore_acknowledgement");
}

TEST_F(AlarmKeeperTest, AShelfWhoseTimeIsOverIsNotGivenBack) {
  Shelve();
  PassWithDriver(61 * kSecond);
  EXPECT_TRUE(store_.Marks("axis1").empty());
  sink_.Clear();
  Hello(kDriver + 1);
  Step(10 * kMillisecond);
  EXPECT_TRUE(Orders().empty());
}

TEST_F(AlarmKeeperTest, UnshelvingEndsIt) {
  Shelve();
  Send(About(3, "unshelve_alarm"));
  Answer({{"alarm", "shelved", "present"}});
  EXPECT_TRUE(store_.Marks("axis1").empty());
}

// The simulation of a whole machine found it: the table grew by what was shelved before a restarted driver had its shelves back.
TEST_F(AlarmKeeperTest, ARestartedDriverTakesNoMoreShelvesThanThereIsRoomForBesideThoseItReceivesAgain) {
  for (std::size_t i = 0; i < AlarmShelves::kMax; ++i)
    Shelve(static_cast<std::uint32_t>(i), "alarm" + std::to_string(i), 60);
  ASSERT_EQ(store_.Marks("axis1").size(), AlarmShelves::kMax);
  sink_.Clear();
  Hello(kDriver + 1);
  Report(Orders().back(), S::STATE_SUCCEEDED, {});  // the first of 32
  sink_.Clear();
  Send(About(100, "shelve_alarm", {{"seconds", "60"}}));
  EXPECT_EQ(Last().state, S::STATE_REJECTED);
  EXPECT_EQ(Last().reason_code, S::REASON_BAD_ARGUMENT);
  EXPECT_TRUE(Orders().empty());
  // One of those that are shelved may be shelved for another time.
  Shelve(101, "alarm7", 90);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(store_.Marks("axis1").size(), AlarmShelves::kMax);
  // Those that end make room.
  Pass(61 * kSecond);
  Hello(kDriver + 1);
  Shelve(102, "battery_error", 60);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().text.find("could not keep it"), std::string::npos) << Last().text;
}

TEST_F(AlarmKeeperTest, AnOldMessageOfTheDriverEndsNothing) {
  driver_status_t early{};
  early.kind = driver_status_t::KIND_ACKNOWLEDGED;
  early.device = "axis1";
  early.utime = now_.utime - 1;
  Acknowledge();
  FromDriver(early);
  EXPECT_EQ(store_.Marks("axis1").size(), 1);
}

TEST_F(AlarmKeeperTest, ClientsAreNotOfferedWhatRestores) {
  EXPECT_EQ(Send(About(1, "restore_acknowledgement")).reason_code, S::REASON_UNKNOWN_OPERATION);
}

}  // namespace
}  // namespace axlecast
