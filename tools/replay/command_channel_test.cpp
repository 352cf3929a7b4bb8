#include "tools/replay/command_channel.h"

#include <gtest/gtest.h>

#include <array>
#include <axlecast/command_t.hpp>
#include <axlecast/permit_t.hpp>
#include <axlecast/position_t.hpp>

namespace axlecast {
namespace {

TEST(CommandChannel, IsKnownByItsName) {
  for (const char* name : {"COMMAND", "COMMAND_STATUS", "PERMIT/axis1", "PERMIT/", "DRIVER_COMMAND/rs485-0",
                           "DRIVER_STATUS/rs485-0"}) {
    EXPECT_EQ(JudgeCommandChannel(name), CommandChannel::kPlain) << name;
  }
  for (const char* name :
       {"cell1/COMMAND", "m_COMMAND_STATUS", "xPERMIT/axis1", "ROBOT_COMMAND", "a/DRIVER_COMMAND/b"}) {
    EXPECT_EQ(JudgeCommandChannel(name), CommandChannel::kBehindPrefix) << name;
  }
  for (const char* name :
       {"POSITION/axis1", "COMMANDS", "PERMIT", "COMMAND/axis1", "DRIVER_STATUS", "", "command"}) {
    EXPECT_EQ(JudgeCommandChannel(name), CommandChannel::kNone) << name;
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

}  // namespace
}  // namespace axlecast
