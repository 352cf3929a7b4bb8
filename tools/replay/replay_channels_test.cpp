#include "tools/replay/replay_channels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <array>
#include <axlecast/command_t.hpp>
#include <axlecast/permit_t.hpp>
#include <axlecast/position_t.hpp>

#include "tools/log/log_event.h"

namespace axlecast {
namespace {

TEST(CommandChannel, IsKnownByItsName) {
  for (const char* name : {"COMMAND", "COMMAND_STATUS", "PERMIT/axis1", "PERMIT/", "DRIVER_COMMAND/rs485-0",
                           "DRIVER_STATUS/rs485-0"}) {
    EXPECT_EQ(CommandChannelOf(name), CommandChannel::kPlain) << name;
  }
  for (const char* name :
       {"cell1/COMMAND", "m_COMMAND_STATUS", "xPERMIT/axis1", "ROBOT_COMMAND", "a/DRIVER_COMMAND/b"}) {
    EXPECT_EQ(CommandChannelOf(name), CommandChannel::kAfterPrefix) << name;
  }
  for (const char* name :
       {"POSITION/axis1", "COMMANDS", "PERMIT", "COMMAND/axis1", "DRIVER_STATUS", "", "command"}) {
    EXPECT_EQ(CommandChannelOf(name), CommandChannel::kNone) << name;
  }
}

template <typename Type>
bool IsCommand(const Type& message) {
  std::array<std::uint8_t, 1'400> buffer;
  const int size = message.encode(buffer.data(), 0, static_cast<int>(buffer.size()));
  return IsCommandMessage(Bytes(buffer.data(), static_cast<std::size_t>(size)));
}

TEST(CommandMessage, IsKnownByItsType) {
  EXPECT_TRUE(IsCommand(command_t{}));
  EXPECT_TRUE(IsCommand(permit_t{}));
  EXPECT_FALSE(IsCommand(position_t{}));
  EXPECT_FALSE(IsCommandMessage({}));
}

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
  EXPECT_TRUE(channels.Select("^POSITION/|axis2$", false));
  EXPECT_TRUE(channels.Of("POSITION/axis1").selected);
  EXPECT_TRUE(channels.Of("ALARM/axis2").selected);
  EXPECT_FALSE(channels.Of("ALARM/axis1").selected);
}

TEST(ReplayChannels, PlayTheOthersWhenInverted) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Select("^POSITION/", true));
  EXPECT_FALSE(channels.Of("POSITION/axis1").selected);
  EXPECT_TRUE(channels.Of("ALARM/axis1").selected);
  EXPECT_FALSE(channels.Of(kRecorderChannel).selected);
}

TEST(ReplayChannels, AreRenamedOneRuleAfterTheOtherThenPrefixed) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Rename("axis([0-9])=joint$1"));
  EXPECT_TRUE(channels.Rename("^POSITION/joint1$=A=B"));
  channels.Prefix("old/");
  EXPECT_EQ(channels.Of("POSITION/axis1").name, "old/A=B");
  EXPECT_EQ(channels.Of("POSITION/axis2").name, "old/POSITION/joint2");
}

TEST(ReplayChannels, AreJudgedByTheNameUnderWhichTheyArePublished) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Rename("^COMMAND$=ASKED"));
  EXPECT_TRUE(channels.Rename("^POSITION/.*=COMMAND"));
  EXPECT_EQ(channels.Of("COMMAND").command, CommandChannel::kNone);
  EXPECT_EQ(channels.Of("POSITION/axis1").command, CommandChannel::kPlain);
  EXPECT_EQ(channels.Of("COMMAND_STATUS").command, CommandChannel::kPlain);
}

TEST(ReplayChannels, SayWhatIsWrongWithAnExpression) {
  ReplayChannels channels;
  EXPECT_THAT(channels.Select("(POSITION", false).error().text,
              HasSubstr("'(POSITION' is no regular expression ("));
  EXPECT_THAT(channels.Rename("[=x").error().text, HasSubstr("'[' is no regular expression ("));
  EXPECT_THAT(channels.Rename("axis1").error().text, HasSubstr("is not OLD=NEW"));
  EXPECT_THAT(channels.Rename("=x").error().text, HasSubstr("is not OLD=NEW"));
  EXPECT_THAT(channels.Select(std::string(100'000, '('), false).error().text, HasSubstr("at most 1000 characters"));
}

}  // namespace

}  // namespace axlecast
