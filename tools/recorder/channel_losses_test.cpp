#include "tools/recorder/channel_losses.h"

#include <gtest/gtest.h>

#include <axlecast/command_t.hpp>
#include <axlecast/position_t.hpp>
#include <string>
#include <vector>

namespace axlecast {
namespace {

template <typename Message>
void On(ChannelLosses& losses, const char* channel, std::int64_t seq, std::int64_t boot_id = 1) {
  Message message{};
  message.boot_id = boot_id;
  message.seq = seq;
  std::vector<std::uint8_t> data(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(data.data(), 0, static_cast<int>(data.size()));
  losses.On({0, channel, data});
}

TEST(ChannelLosses, CountsTheGapsOfEachChannel) {
  ChannelLosses losses;
  for (const std::int64_t seq : {5, 6, 9}) On<position_t>(losses, "POSITION/axis1", seq);
  for (const std::int64_t seq : {1, 7}) On<position_t>(losses, "POSITION/axis2", seq);
  On<position_t>(losses, "POSITION/axis2", 100, 2);
  for (const std::int64_t seq : {1, 2}) On<position_t>(losses, "POSITION/axis3", seq);
  const auto found = losses.losses();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].channel, "POSITION/axis2");
  EXPECT_EQ(found[0].lost, 5);
  EXPECT_EQ(found[0].received, 3);
  EXPECT_EQ(found[1].channel, "POSITION/axis1");
  EXPECT_EQ(found[1].lost, 2);
}

TEST(ChannelLosses, CountsThoseThatCameFirstHoweverManyChannelsAreInvented) {
  ChannelLosses losses;
  On<position_t>(losses, "POSITION/axis1", 0);
  for (int i = 0; i < 10'000; ++i) {
    const std::string channel = "POSITION/x" + std::to_string(i);
    for (const std::int64_t seq : {0, 2}) On<position_t>(losses, channel.c_str(), seq);
  }
  On<position_t>(losses, "POSITION/axis1", 9);
  const auto found = losses.losses();
  EXPECT_EQ(found.size(), ChannelLosses::kMaxChannels);
  EXPECT_EQ(found[0].channel, "POSITION/axis1");
  EXPECT_EQ(found[0].lost, 8);
}

TEST(ChannelLosses, PassesOverWhatHasNoNumbers) {
  ChannelLosses losses;
  for (const std::int64_t seq : {1, 9}) On<command_t>(losses, "COMMAND", seq);  // each client counts by itself
  losses.On({0, "X", {}});
  const std::vector<std::uint8_t> text(100, 'x');
  losses.On({0, "X", text});
  EXPECT_TRUE(losses.losses().empty());
}

}  // namespace
}  // namespace axlecast
