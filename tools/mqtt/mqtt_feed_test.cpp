#include "tools/mqtt/mqtt_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/alarm_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <limits>
#include <regex>
#include <vector>

#include "core/command/keys.h"
#include "core/messages/message.h"
#include "tools/mqtt/topics.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class MqttFeedTest : public ::testing::Test {
 protected:
  MqttFeedTest() {
    machine_.machine = "press3";
    machine_.mqtt.prefix = "plant/a";
    machine_.mqtt.positions = {kSecond, 0.5, 10 * kSecond};
    machine_.mqtt.devices["axis2"] = {kSecond / 10, 0, kSecond};
    BusConfig bus;
    bus.name = "rs485-0";
    for (const char* name : {"axis1", "axis2"}) {
      DeviceConfig device;
      device.name = name;
      bus.devices.push_back(device);
    }
    machine_.buses.push_back(bus);
  }

  MqttFeed& feed() {
    if (!feed_) {
      feed_.emplace(machine_, [this](BrokerMessage message, RetentionClass keeping) {
        published_.push_back(std::move(message));
        keepings_.push_back(keeping);
      });
    }
    return *feed_;
  }
  void Position(double value, MonoNs after = 0, std::int32_t flags = position_t::FLAG_VALID,
                const std::string& device = "axis1") {
    now_ += after;
    position_t position{};
    position.seq = seq_++;
    position.value = value;
    position.unit = position_t::UNIT_MM;
    position.flags = flags;
    feed().OnData("POSITION/" + device, Encoded(position), now_);
  }
  void Alarm(std::int64_t revision, const std::string& of = "axis1") {
    alarm_t alarm{};
    alarm.seq = seq_++;
    alarm.revision = revision;
    alarm.device = of;
    feed().OnData("ALARM/" + of, Encoded(alarm), now_);
  }
  std::vector<double> Values() const {
    std::vector<double> values;
    for (const BrokerMessage& message : published_) values.push_back(Json(message).at("value"));
    return values;
  }
  static nlohmann::json Json(const BrokerMessage& message) { return nlohmann::json::parse(message.payload); }

  MachineConfig machine_;
  std::optional<MqttFeed> feed_;
  std::vector<BrokerMessage> published_;
  std::vector<RetentionClass> keepings_;
  MonoNs now_ = 1'000 * kSecond;
  std::int64_t seq_ = 0;
};

// LIMITS had a topic and a schema, and was never received.
TEST_F(MqttFeedTest, EachKindOfTopicIsAmongTheChannelsThatAreReceived) {
  std::size_t kinds = 0;
  const nlohmann::ordered_json schemas = MqttSchemas();
  for (const auto& [kind, schema] : schemas.at("$defs").items()) {
    if (kind == "command" || kind == "status") continue;
    std::string channel = kind + "/axis1";
    std::transform(kind.begin(), kind.end(), channel.begin(),
                   [](char c) { return static_cast<char>(std::toupper(c)); });
    EXPECT_TRUE(std::regex_match(channel, std::regex(MqttDataChannels()))) << channel;
    ++kinds;
  }
  EXPECT_EQ(kinds, 8U);
}

TEST_F(MqttFeedTest, APositionAsJsonUnderItsTopic) {
  Position(12.5);
  ASSERT_EQ(published_.size(), 1U);
  EXPECT_EQ(published_[0].topic, "plant/a/press3/position/axis1");
  EXPECT_FALSE(published_[0].retain);
  EXPECT_EQ(keepings_[0], RetentionClass::kSamples);
  const nlohmann::json json = Json(published_[0]);
  EXPECT_EQ(json.at("value"), 12.5);
  EXPECT_EQ(json.at("unit_name"), "mm");
  EXPECT_EQ(json.at("flag_names"), nlohmann::json::array({"valid"}));
  EXPECT_EQ(json.at("publication"), 0);
  EXPECT_FALSE(json.contains("spare"));
}

TEST_F(MqttFeedTest, PositionsNoOftenerThanTheInterval) {
  for (int i = 0; i < 2'500; ++i) Position(i, kMillisecond);
  EXPECT_THAT(Values(), ElementsAre(0, 1'000, 2'000));
  EXPECT_EQ(feed().counts().received, 2'500);
  EXPECT_EQ(feed().counts().lost, 0);
}

TEST_F(MqttFeedTest, ADeviceMayHaveItsOwnPace) {
  for (int i = 0; i < 250; ++i) Position(i, kMillisecond, position_t::FLAG_VALID, "axis2");
  EXPECT_THAT(Values(), ElementsAre(0, 100, 200));
}

TEST_F(MqttFeedTest, WithinTheDeadbandOnlyNowAndThen) {
  for (int i = 0; i < 21; ++i) Position(i % 2 == 0 ? 0 : 0.4, kSecond);
  EXPECT_THAT(Values(), ElementsAre(0, 0, 0)) << "each 10 s";
  Position(0.51, kSecond);
  EXPECT_EQ(Values().back(), 0.51);
}

TEST_F(MqttFeedTest, TheLastPositionBeforeAStandstillIsNotKeptBack) {
  Position(0);
  Position(1, kMillisecond);
  Position(7, kMillisecond);
  feed().Poll(now_ + kSecond / 2);
  EXPECT_THAT(Values(), ElementsAre(0));
  feed().Poll(now_ + kSecond);
  EXPECT_THAT(Values(), ElementsAre(0, 7));
  feed().Poll(now_ + 100 * kSecond);
  EXPECT_THAT(Values(), ElementsAre(0, 7)) << "an old event is not published again";
}

TEST_F(MqttFeedTest, AChangedFlagIsNewsWithinTheDeadband) {
  Position(1);
  Position(1, kSecond, 0);
  Position(1, kSecond, position_t::FLAG_AFTER_GAP);
  ASSERT_EQ(published_.size(), 2U);
  EXPECT_EQ(Json(published_[1]).at("flags"), 0);
}

TEST_F(MqttFeedTest, AnUnknownValueIsNullAndNoNewsTwice) {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  Position(unknown);
  Position(unknown, kSecond);
  Position(1, kSecond);
  ASSERT_EQ(published_.size(), 2U);
  EXPECT_TRUE(Json(published_[0]).at("value").is_null());
}

TEST_F(MqttFeedTest, AStateWhenItChangesElseOnceAMinute) {
  for (int i = 0; i < 125; ++i) {
    Alarm(1);
    now_ += kSecond;
  }
  EXPECT_EQ(published_.size(), 3U);
  Alarm(2);
  ASSERT_EQ(published_.size(), 4U);
  EXPECT_TRUE(published_[3].retain);
  EXPECT_EQ(keepings_[3], RetentionClass::kNewest);
  EXPECT_EQ(Json(published_[3]).at("publication"), 3);
}

TEST_F(MqttFeedTest, StatesAreToldAnewToABrokerThatMayHaveForgottenThem) {
  Alarm(1);
  Position(1);
  feed().RepublishStates();
  now_ += kMillisecond;
  Alarm(1);
  Position(1);
  ASSERT_EQ(published_.size(), 3U);
  EXPECT_EQ(published_[2].topic, "plant/a/press3/alarm/axis1");
}

TEST_F(MqttFeedTest, NamesThatAreNotTheMachinesGoNowhere) {
  Alarm(1, "axis3");
  Alarm(1, "a/+/#");
  Alarm(1, "recorder/a b");
  feed().OnData("POSITION/rs485-0", Encoded(position_t{}), now_);
  feed().OnData("WIRE/rs485-0", Encoded(position_t{}), now_);
  feed().OnData("POSITION/axis1", Encoded(alarm_t{}), now_);
  EXPECT_THAT(published_, IsEmpty());
  EXPECT_EQ(feed().counts().foreign, 6);
  Alarm(1, "bridge");
  Alarm(1, "recorder/all");
  Alarm(1, "mqtt/press3");
  ASSERT_EQ(published_.size(), 3U);
  EXPECT_EQ(published_[1].topic, "plant/a/press3/alarm/recorder/all");
}

TEST_F(MqttFeedTest, RecordersOfAnyNameAreFew) {
  for (int i = 0; i < 100; ++i) Alarm(1, "recorder/r" + std::to_string(i));
  EXPECT_EQ(published_.size(), 32U);
}

TEST_F(MqttFeedTest, ATripIsToldOnce) {
  trip_log_t trip{};
  trip.device = "axis1";
  trip.trip_count = 3;
  for (std::int64_t i = 0; i < 3; ++i) {
    trip.seq = i;
    trip.utime = i;
    feed().OnData("TRIP/axis1", Encoded(trip), now_);
  }
  trip.trip_count = 4;
  feed().OnData("TRIP/axis1", Encoded(trip), now_);
  ASSERT_EQ(published_.size(), 2U);
  EXPECT_EQ(keepings_[0], RetentionClass::kEvents);
  EXPECT_FALSE(published_[0].retain);
}

TEST_F(MqttFeedTest, OutcomesOfCommandsWithoutTheirTokens) {
  command_status_t status{};
  status.device = "axis1";
  status.state = command_status_t::STATE_RUNNING;
  status.token[0] = 7;
  feed().OnCommandStatus(Encoded(status), now_);
  EXPECT_THAT(published_, IsEmpty()) << "no outcome yet";
  status.state = command_status_t::STATE_SUCCEEDED;
  status.is_final = 1;
  feed().OnCommandStatus(Encoded(status), now_);
  feed().OnCommandStatus(Encoded(status), now_);
  ASSERT_EQ(published_.size(), 1U);
  EXPECT_EQ(published_[0].topic, "plant/a/press3/command/axis1");
  EXPECT_EQ(Json(published_[0]).at("state_name"), "succeeded");
  EXPECT_FALSE(Json(published_[0]).contains("token"));
  EXPECT_FALSE(Json(published_[0]).contains("sig"));
}

TEST_F(MqttFeedTest, OutcomesThatTheBridgeHasNotSignedGoNowhere) {
  const SigningKey bridge = SigningKey::Generate();
  machine_.bridge.bridge.public_key = bridge.public_key();
  command_status_t status{};
  status.device = "axis1";
  status.is_final = 1;
  feed().OnCommandStatus(Encoded(status), now_);
  EXPECT_THAT(published_, IsEmpty());
  EXPECT_EQ(feed().counts().foreign, 1);
  SignMessage(bridge, Domain::kStatus, status);
  feed().OnCommandStatus(Encoded(status), now_);
  EXPECT_EQ(published_.size(), 1U);
}

TEST_F(MqttFeedTest, CountsWhatLcmHasLost) {
  Position(1);
  seq_ += 5;
  Position(2);
  EXPECT_EQ(feed().counts().lost, 5);
}

TEST_F(MqttFeedTest, PublishesAtTheEndWhatHasWaitedForItsTime) {
  Position(0);
  Position(3, kMillisecond);
  Position(0.1, kMillisecond, position_t::FLAG_VALID, "axis2");
  feed().Flush();
  EXPECT_THAT(Values(), ElementsAre(0, 0.1, 3));
}

TEST_F(MqttFeedTest, PassesOverDamagedMessages) {
  const std::vector<std::uint8_t> whole = Encoded(position_t{});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    feed().OnData("POSITION/axis1", Bytes(whole.data(), size), now_);
    feed().OnCommandStatus(Bytes(whole.data(), size), now_);
  }
  EXPECT_THAT(published_, IsEmpty());
}

}  // namespace
}  // namespace axlecast
