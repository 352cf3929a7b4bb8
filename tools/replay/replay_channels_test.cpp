#include "tools/replay/replay_channels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/log/log_header.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

TEST(ReplayChannels, PlayAllButTheLogsBookkeepingUnderTheirNames) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Of("POSITION/axis1").selected);
  EXPECT_EQ(channels.Of("POSITION/axis1").name, "POSITION/axis1");
  EXPECT_TRUE(channels.Of("").selected);
  EXPECT_FALSE(channels.Of(kSchemaChannel).selected);
  EXPECT_FALSE(channels.Of(kMachineChannel).selected);
}

TEST(ReplayChannels, PlayThoseInWhichTheExpressionIsFound) {
  ReplayChannels channels;
  EXPECT_EQ(channels.Select("^POSITION/|axis2$", false), "");
  EXPECT_TRUE(channels.Of("POSITION/axis1").selected);
  EXPECT_TRUE(channels.Of("ALARM/axis2").selected);
  EXPECT_FALSE(channels.Of("ALARM/axis1").selected);
}

TEST(ReplayChannels, PlayTheOthersWhenInverted) {
  ReplayChannels channels;
  EXPECT_EQ(channels.Select("^POSITION/", true), "");
  EXPECT_FALSE(channels.Of("POSITION/axis1").selected);
  EXPECT_TRUE(channels.Of("ALARM/axis1").selected);
  EXPECT_FALSE(channels.Of(kRecorderChannel).selected);
}

TEST(ReplayChannels, AreRenamedOneRuleAfterTheOtherThenPrefixed) {
  ReplayChannels channels;
  EXPECT_EQ(channels.Rename("axis([0-9])=joint$1"), "");
  EXPECT_EQ(channels.Rename("^POSITION/joint1$=A=B"), "");
  channels.Prefix("old/");
  EXPECT_EQ(channels.Of("POSITION/axis1").name, "old/A=B");
  EXPECT_EQ(channels.Of("POSITION/axis2").name, "old/POSITION/joint2");
}

TEST(ReplayChannels, AreJudgedByTheNameUnderWhichTheyArePublished) {
  ReplayChannels channels;
  EXPECT_EQ(channels.Rename("^COMMAND$=ASKED"), "");
  EXPECT_EQ(channels.Rename("^POSITION/.*=COMMAND"), "");
  EXPECT_EQ(channels.Of("COMMAND").command, CommandChannel::kNone);
  EXPECT_EQ(channels.Of("POSITION/axis1").command, CommandChannel::kPlain);
  EXPECT_EQ(channels.Of("COMMAND_STATUS").command, CommandChannel::kPlain);
}

TEST(ReplayChannels, SayWhatIsWrongWithAnExpression) {
  ReplayChannels channels;
  EXPECT_THAT(channels.Select("(POSITION", false), HasSubstr("'(POSITION' is no regular expression ("));
  EXPECT_THAT(channels.Rename("[=x"), HasSubstr("'[' is no regular expression ("));
  EXPECT_THAT(channels.Rename("axis1"), HasSubstr("is not OLD=NEW"));
  EXPECT_THAT(channels.Rename("=x"), HasSubstr("is not OLD=NEW"));
  EXPECT_THAT(channels.Select(std::string(100'000, '('), false), HasSubstr("at most 1000 characters"));
}

}  // namespace
}  // namespace axlecast
