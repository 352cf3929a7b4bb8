#include "tools/log/channel_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using testing::HasSubstr;

TEST(ChannelFilter, WithoutAnExpressionTakesAll) {
  ChannelFilter filter;
  EXPECT_TRUE(filter.Matches("A"));
  EXPECT_TRUE(filter.Set("", false));
  EXPECT_TRUE(filter.Matches("A"));
  EXPECT_THAT(filter.Set("", true).error().text, HasSubstr("all channels are selected"));
}

TEST(ChannelFilter, FindsItsExpressionAnywhere) {
  ChannelFilter filter;
  ASSERT_TRUE(filter.Set("axis[12]$|^BUS", false));
  for (int again = 0; again < 2; ++again) {
    EXPECT_TRUE(filter.Matches("POSITION/axis1"));
    EXPECT_TRUE(filter.Matches("BUS/rs485-0"));
    EXPECT_FALSE(filter.Matches("POSITION/axis12"));
  }
}

TEST(ChannelFilter, InvertedTakesTheOthers) {
  ChannelFilter filter;
  ASSERT_TRUE(filter.Set("^POSITION/", true));
  EXPECT_FALSE(filter.Matches("POSITION/axis1"));
  EXPECT_TRUE(filter.Matches("ALARM/axis1"));
}

TEST(ChannelFilter, ABadExpressionIsNamed) {
  ChannelFilter filter;
  EXPECT_THAT(filter.Set("axis(1", false).error().text, HasSubstr("'axis(1' is no regular expression"));
}

TEST(ChannelFilter, StandsAnyNumberOfChannels) {
  ChannelFilter filter;
  ASSERT_TRUE(filter.Set("7$", false));
  for (int i = 0; i < 30'000; ++i) EXPECT_EQ(filter.Matches("C" + std::to_string(i)), i % 10 == 7);
}

}  // namespace
}  // namespace axlecast
