#include "platform/net/channel_pattern.h"

#include <gtest/gtest.h>

#include <regex>
#include <string>

namespace axlecast {
namespace {

// What is compared as text must match the same names as the regular expression.
TEST(ChannelPattern, MatchesTheNamesOfTheRegularExpression) {
  for (const std::string expression : {"TIME/.*",
                                       ".*",
                                       "DRIVER_STATUS/rs485-0",
                                       "(POSITION|DEVICE)/.*",
                                       "(POSITION|DEVICE)/axis1",
                                       "(A||B)",
                                       "()",
                                       "",
                                       "(A|B).*",
                                       "(A)",
                                       "A|TIME/x",
                                       "A.*B",
                                       "(A|B)+",
                                       "((A)|B)",
                                       "(?:A|B)x",
                                       "TIME\\.*",
                                       "A.",
                                       ".*.*",
                                       "(A|B)/x.*",
                                       "[A-Z]*/.*",
                                       "(A|B)|C"}) {
    const auto pattern = ChannelPattern::Of(expression);
    ASSERT_TRUE(pattern) << expression;
    const std::regex regex(expression);
    for (const std::string name : {"",
                                   "A",
                                   "B",
                                   "AB",
                                   "A/x",
                                   "B/xy",
                                   "C",
                                   "Bx",
                                   "TIME/",
                                   "TIME/x",
                                   "TIME/x\ny",
                                   "TIME/x\r",
                                   "TIME/\n",
                                   "TIME",
                                   "TIMEx",
                                   "TIME...",
                                   "XTIME/x",
                                   "\n",
                                   "DRIVER_STATUS/rs485-0",
                                   "DRIVER_STATUS/rs485-01",
                                   "POSITION/axis1",
                                   "DEVICE/axis1",
                                   "DEVICE/axis12",
                                   "POSITION|DEVICE/axis1",
                                   "POSITION/",
                                   "Ax\rB"}) {
      EXPECT_EQ(pattern->Matches(name), std::regex_match(name, regex)) << expression << ", " << name;
    }
  }
}

// The channels to which drivers, `up`, the page and the bridge subscribe.
TEST(ChannelPattern, ComparesTheUsualExpressionsAsText) {
  for (const std::string expression : {"DRIVER_COMMAND/rs485-0", "DRIVER_TIME/.*", ".*", "COMMAND",
                                       "(POSITION|MOTOR|LIMITS|DEVICE|ALARM|BUS|TIME)/.*"}) {
    EXPECT_TRUE(ChannelPattern::Of(expression)->IsText()) << expression;
  }
  EXPECT_FALSE(ChannelPattern::Of("POSITION/axis[12]")->IsText());
}

TEST(ChannelPattern, RefusesAnInvalidExpression) {
  for (const std::string expression : {"(", ")", "a)(b", "(A|B", "*", "A|B)/.*", "[", "(A|B))/.*", "(?A)"}) {
    EXPECT_FALSE(ChannelPattern::Of(expression)) << expression;
  }
}

}  // namespace
}  // namespace axlecast
