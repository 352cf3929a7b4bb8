#include "tools/recorder/pre_trigger.h"

#include <gtest/gtest.h>
#include <axlecast/alarm_t.hpp>
#include <string>
#include <vector>

#include "tools/recorder/recorder_fixture.h"

namespace axlecast {
namespace {

constexpr std::int64_t kBegin = 1'700'000'000'000'000;

class TriggerWatchTest : public ::testing::Test {
 protected:
  // An ALARM message that holds these, each of `state`.
  bool OnAlarms(const std::string& channel, const std::vector<std::string>& names,
                std::int8_t state = alarm_entry_t::STATE_LIVE, int total = 0,
                std::int64_t first_utime = kBegin - 1) {
    alarm_t alarms{};
    alarms.n = static_cast<std::int8_t>(names.size());
    alarms.total = static_cast<std::int16_t>(total == 0 ? alarms.n : total);
    for (const std::string& name : names) {
      alarm_entry_t& entry = alarms.entries.emplace_back();
      entry.state = state;
      entry.first_utime = first_utime;
      entry.name = name;
    }
    std::vector<std::uint8_t> data(static_cast<std::size_t>(alarms.getEncodedSize()));
    alarms.encode(data.data(), 0, static_cast<int>(data.size()));
    return watch_.Fires({.channel = channel, .data = data});
  }

  TriggerWatch watch_{std::regex("^ALARM/axis1 battery|^ESTOP$"), kBegin};
};

TEST_F(TriggerWatchTest, AnAlarmFiresWhenItAppears) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"over_speed"}));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"over_speed", "battery_error"}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"over_speed", "battery_error"})) << "repeated each second";
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"})) << "again";
}

TEST_F(TriggerWatchTest, OnlyTheAlarmsThatAreMeant) {
  EXPECT_FALSE(OnAlarms("ALARM/axis2", {}));
  EXPECT_FALSE(OnAlarms("ALARM/axis2", {"battery_error"}));
}

TEST_F(TriggerWatchTest, AnAlarmThatStandsAtTheBeginningDoesNot) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}));
}

TEST_F(TriggerWatchTest, AnAlarmThatAppearsBeforeTheFirstMessageIsHeardFires) {
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_LIVE, 0, kBegin));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_LIVE, 0, kBegin));
}

TEST_F(TriggerWatchTest, AnAlarmThatIsGoneOrUnknownIsNone) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_UNACKNOWLEDGED));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_DEVICE_LATCHED));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_UNKNOWN));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"})) << "back online, it was there all the time";
}

TEST_F(TriggerWatchTest, AnAlarmThatFoundNoRoomInAMessageMayStandStill) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"worse"}, alarm_entry_t::STATE_LIVE, 2));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}));
}

TEST_F(TriggerWatchTest, ANameOfAnyLengthIsStood) {
  watch_ = TriggerWatch(std::regex("ALARM/.* battery"), kBegin);
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {std::string(3'000'000, 'x')}, alarm_entry_t::STATE_LIVE, 0, kBegin));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}));
}

// 10,000 channels of 1,000 alarms each could be remembered: about 1 GB.
TEST_F(TriggerWatchTest, RemembersNoMoreWhateverChannelsAndAlarmsCome) {
  for (int channel = 0; channel < 1'500; ++channel) {
    std::vector<std::string> names;
    for (int i = 0; i < 120; ++i) names.push_back(std::to_string(i));
    EXPECT_FALSE(OnAlarms("ALARM/x" + std::to_string(channel), names));
  }
  EXPECT_LE(watch_.remembered(), 64'000U);
}

TEST_F(TriggerWatchTest, OtherMessagesFireByTheirChannel) {
  EXPECT_TRUE(watch_.Fires(MessageOf("ESTOP", "x", 0)));
  EXPECT_TRUE(watch_.Fires(MessageOf("ESTOP", "x", 0)));
  EXPECT_FALSE(watch_.Fires(MessageOf("ESTOP2", "x", 0)));
}

}  // namespace

}  // namespace axlecast
