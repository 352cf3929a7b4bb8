#include <gmock/gmock.h>
#include <limits>
#include <nlohmann/json.hpp>

#include "tools/axlecast/common/test_monitor.h"
#include "tools/axlecast/live/watch_command.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(MessageWatch, JsonLineHasChannelTypeAndFields) {
  MessageWatch watch(std::regex(""), true);
  const auto line = watch.On("POSITION/axis1", Encoded(PositionMessage(3)));
  ASSERT_TRUE(line);
  EXPECT_THAT(*line, StartsWith("{\"channel\":\"POSITION/axis1\",\"type\":\"position_t\",\"utime\":0,"));
  EXPECT_EQ(line->back(), '\n');
  const auto json = nlohmann::json::parse(*line);
  EXPECT_EQ(json["seq"], 3);
  EXPECT_EQ(json["boot_id"], "0000000000000007");
}

TEST(MessageWatch, ChannelsWithoutEndAreShownButNotRemembered) {
  MessageWatch watch(std::regex(""), true);
  const auto position = Encoded(PositionMessage(3));
  const std::size_t sent = MessageWatch::kMaxChannels + 1'000;
  for (std::size_t i = 0; i < sent; ++i) {
    ASSERT_TRUE(watch.On("POSITION/x" + std::to_string(i), position));
  }
  EXPECT_EQ(watch.shown(), static_cast<std::int64_t>(sent));
  EXPECT_EQ(watch.channels(), MessageWatch::kMaxChannels);
  EXPECT_THAT(watch.Losses(), ElementsAre(StartsWith("1000 messages were of channels beyond the first 4096")));
}

TEST(MessageWatch, LineForPeople) {
  MessageWatch watch(std::regex(""), false);
  position_t position = PositionMessage(3);
  position.utime = 1'700'000'000'000'042;
  EXPECT_EQ(watch.On("POSITION/axis1", Encoded(position)),
            "1700000000.000042 POSITION/axis1  62.500000 mm, turns 12.500000, rpm 60.0, valid,speed_valid\n");
}

TEST(MessageWatch, LinesOfAMotorAndItsTrip) {
  MessageWatch watch(std::regex(""), false);
  motor_health_t motor{};
  motor.voltage_v = 230;
  motor.power_w = std::numeric_limits<float>::quiet_NaN();
  motor.trip_count = 5;
  motor.status_bits = 1;
  motor.flags = std::int32_t{motor_health_t::FLAG_ANALOG_VALID} | motor_health_t::FLAG_STATUS_VALID;
  EXPECT_THAT(watch.On("MOTOR/gm3", Encoded(motor)).value_or(""),
              HasSubstr("MOTOR/gm3  230.0 V, 0.000 A, - W, 0.0 degC, 0.00 m/s2, power upper A, no stop commanded, "
                        "logged out, trips 5\n"));
  EXPECT_THAT(watch.On("TRIP/gm3", Encoded(TripLog())).value_or(""),
              HasSubstr("TRIP/gm3  trip 5, power upper A, log 1, a sample each 0.1 s\n"));
}

TEST(MessageWatch, FiltersByChannel) {
  MessageWatch watch(std::regex("^POSITION/axis1$"), true);
  EXPECT_TRUE(watch.On("POSITION/axis1", Encoded(PositionMessage(0))));
  EXPECT_FALSE(watch.On("POSITION/axis10", Encoded(PositionMessage(0))));
  EXPECT_EQ(watch.shown(), 1);
  EXPECT_TRUE(watch.Losses().empty());
}

TEST(MessageWatch, NamesTheChannelsThatAnExpressionDoesNotFind) {
  MessageWatch watch(std::regex("^POSITON/"), true);
  EXPECT_EQ(watch.OtherChannels(), "");
  for (int i = 0; i < 20; ++i) EXPECT_EQ(watch.On("POSITION/axis" + std::to_string(i % 2), {}), std::nullopt);
  EXPECT_EQ(watch.OtherChannels(), "POSITION/axis0, POSITION/axis1");
  for (int i = 0; i < 1'000; ++i) EXPECT_EQ(watch.On("CHANNEL" + std::to_string(i), {}), std::nullopt);
  EXPECT_THAT(watch.OtherChannels(), ::testing::EndsWith(" and more"));
}

TEST(MessageWatch, TellsWhatWasLostAndWhatIsForeign) {
  MessageWatch watch(std::regex(""), true);
  for (const std::int64_t seq : {0, 4}) EXPECT_TRUE(watch.On("POSITION/axis1", Encoded(PositionMessage(seq))));
  const std::vector<std::uint8_t> unknown(20, 1);
  EXPECT_FALSE(watch.On("OTHER", unknown));
  EXPECT_THAT(watch.Losses(), ElementsAre("POSITION/axis1: 3 of 5 messages lost on the way here",
                                          "1 messages that are not axlecast's were not shown"));
}

TEST(MessageWatch, TableHasOneRowPerChannel) {
  MessageWatch watch(std::regex(""), false);
  static_cast<void>(watch.Table(100 * kSecond));
  for (std::int64_t seq = 0; seq < 10; ++seq)
    static_cast<void>(watch.On("POSITION/axis1", Encoded(PositionMessage(seq))));
  const auto lines = watch.Table(101 * kSecond);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[1], HasSubstr("POSITION/axis1"));
  EXPECT_THAT(lines[1], HasSubstr("10.0  62.500000 mm"));
}

}  // namespace

}  // namespace axlecast
