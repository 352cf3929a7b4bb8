#include "tools/axlecast/logs/live_traffic_detector.h"

#include <gmock/gmock.h>

#include <axlecast/recorder_health_t.hpp>

#include "tools/monitor/one_axis.h"

namespace axlecast {
namespace {

TEST(LiveChannels, AreThoseOfAMachinesMessages) {
  LiveChannels channels;
  EXPECT_EQ(channels.Text(), "");
  channels.On("RECORDER/main", Encoded(recorder_health_t{}));
  const std::vector<std::uint8_t> foreign(100, 'x');
  channels.On("OTHER", foreign);
  EXPECT_EQ(channels.Text(), "") << "a recorder alone is no machine, and neither is what is none of ours";
  for (int i = 0; i < 3; ++i) channels.On("POSITION/axis1", Encoded(PositionMessage(i)));
  channels.On("BUS/b0", Encoded(BusMessage(0)));
  EXPECT_EQ(channels.Text(), "BUS/b0, POSITION/axis1");
  for (int i = 2; i < 8; ++i) channels.On("POSITION/axis" + std::to_string(i), Encoded(PositionMessage(i)));
  EXPECT_THAT(channels.Text(), ::testing::EndsWith("POSITION/axis5 and 2 more"));
}

TEST(LiveChannels, AreBoundedHoweverManyNamesAreInvented) {
  LiveChannels channels;
  const std::vector<std::uint8_t> message = Encoded(PositionMessage(0));
  for (int i = 0; i < 5'000; ++i) channels.On("POSITION/x" + std::to_string(i), message);
  EXPECT_EQ(channels.size(), LiveChannels::kMaxChannels);
}

}  // namespace
}  // namespace axlecast
