#include "tools/mqtt/mqtt_status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class MqttAlarmsTest : public ::testing::Test {
 protected:
  std::vector<std::string> Names(MonoNs after = kSecond) {
    now_ += after;
    std::vector<std::string> names;
    for (const alarm_entry_t& entry : alarms_.Make(status_, now_, now_ / kMicrosecond).entries) {
      names.push_back(entry.name + (entry.state == alarm_entry_t::STATE_LIVE ? "" : " was"));
    }
    return names;
  }

  MonoNs now_ = 1'000 * kSecond;
  MqttStatus status_;
  MqttAlarms alarms_{"mqtt/press3", Origin{.boot_id = 7}, 1'000 * kSecond};
};

TEST_F(MqttAlarmsTest, ABrokerThatStaysAwayAndComesBack) {
  EXPECT_THAT(Names(), IsEmpty());
  EXPECT_THAT(Names(MqttAlarms::kAway), ElementsAre("broker_away"));
  status_.broker = {true, now_, 1, ""};
  EXPECT_THAT(Names(), IsEmpty());
  status_.broker = {false, now_, 1, "Connection refused"};
  EXPECT_THAT(Names(MqttAlarms::kAway - 1), IsEmpty());
  EXPECT_THAT(Names(1), ElementsAre("broker_away"));
}

TEST_F(MqttAlarmsTest, LossesStayKnown) {
  status_.broker.connected = true;
  status_.outbox.shed[2] = 5;
  EXPECT_THAT(Names(), ElementsAre("mqtt_messages_shed"));
  EXPECT_THAT(Names(), ElementsAre("mqtt_messages_shed was"));
  status_.outbox.refused = 1;
  EXPECT_THAT(Names(), ElementsAre("mqtt_refused", "mqtt_messages_shed was"));
}

TEST_F(MqttAlarmsTest, StatusLineNamesEachLoss) {
  status_.broker.connected = true;
  status_.outbox.taken = 12;
  status_.outbox.shed = {1, 2, 3};
  status_.feed.lost = 4;
  EXPECT_EQ(
      MqttStatusLine(status_),
      "connected, 12 messages delivered, 0 wait; 3 samples shed; 2 events shed; 1 states shed; 4 lost on LCM");
  EXPECT_EQ(status_.Lost(), 10);
}

}  // namespace
}  // namespace axlecast
