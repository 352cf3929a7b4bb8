#include "drivers/runtime/command/axis_commands.h"

#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>

#include "drivers/runtime/command/operations_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using Status = command_status_t;

constexpr AlarmSpec kBattery = {6, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_ERROR, "battery_error",
                                ""};

class AlarmOrderTest : public OperationsTest {
 protected:
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

}  // namespace
}  // namespace axlecast
