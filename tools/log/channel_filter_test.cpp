#include "tools/log/channel_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using testing::HasSubstr;

TEST(ChannelFilter, WithoutAnExpressionTakesAll) {
  ChannelFilter filter;
  EXPECT_TRUE(filter.Takes("A"));
  EXPECT_EQ(filter.Set("", false), "");
  EXPECT_TRUE(filter.Takes("A"));
  EXPECT_THAT(filter.Set("", true), HasSubstr("nothing to invert"));
}

TEST(ChannelFilter, FindsItsExpressionAnywhere) {
  ChannelFilter filter;
  ASSERT_EQ(filter.Set("axis[12]$|^BUS", false), "");
  for (int again = 0; again < 2; ++again) {
    EXPECT_TRUE(filter.Takes("POSITION/axis1"));
    EXPECT_TRUE(filter.Takes("BUS/rs485-0"));
    EXPECT_FALSE(filter.Takes("POSITION/axis12"));
  }
}

TEST(ChannelFilter, InvertedTakesTheOthers) {
  ChannelFilter filter;
  ASSERT_EQ(filter.Set("^POSITION/", true), "");
  EXPECT_FALSE(filter.Takes("POSITION/axis1"));
  EXPECT_TRUE(filter.Takes("ALARM/axis1"));
}

TEST(ChannelFilter, ABadExpressionIsNamed) {
  ChannelFilter filter;
  EXPECT_THAT(filter.Set("axis(1", false), HasSubstr("'axis(1' is no regular expression"));
}

TEST(ChannelFilter, StandsAnyNumberOfChannels) {
  ChannelFilter filter;
  ASSERT_EQ(filter.Set("7$", false), "");
  for (int i = 0; i < 30'000; ++i) EXPECT_EQ(filter.Takes("C" + std::to_string(i)), i % 10 == 7);
}

}  // namespace
}  // namespace axlecast
