#include "client/command/command_sessions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <vector>

#include "core/messages/message.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

using Kind = CommandSessions::Kind;
using S = command_status_t;

CommandId Id(int number) {
  CommandId id{};
  id[0] = static_cast<std::uint8_t>(number & 255);
  id[1] = static_cast<std::uint8_t>(number >> 8);
  return id;
}

std::vector<std::uint8_t> Encoded(const CommandId& id, std::int8_t state) {
  S status{};
  std::copy(id.begin(), id.end(), std::begin(status.id));
  status.boot_id = 9;
  status.state = state;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(status.getEncodedSize()));
  status.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

class CommandSessionsTest : public testing::Test {
 protected:
  [[nodiscard]] const CommandResult& Result(const CommandId& id) const {
    return sessions_.Find({Kind::kCommand, id})->result();
  }

  FakeClock clock_;
  MemorySink sink_;
  CommandSessions sessions_{clock_, sink_, 77, {}};
};

TEST_F(CommandSessionsTest, ManyAreUnderWayAndEachHearsItsOwn) {
  sessions_.Send(Id(1), {.device = "axis1", .operation = "zero"});
  sessions_.Send(Id(2), {.device = "axis2", .operation = "zero"});
  EXPECT_EQ(sessions_.Poll(), clock_.Now() + CommandSession::kRepeat);
  EXPECT_EQ(sink_.All<command_t>("COMMAND").size(), 2U);
  sessions_.OnStatus(Encoded(Id(2), S::STATE_UNKNOWN), nullptr);
  sink_.Clear();
  static_cast<void>(sessions_.Poll());
  const auto sent = sink_.All<command_t>("COMMAND");
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].seq, 2);
  EXPECT_EQ(sent[0].boot_id, 77);
  EXPECT_EQ(DecodeMessage<command_body_t>(sent[0].body)->device, "axis2");
}

TEST_F(CommandSessionsTest, WhatDoesNotFitIsRefusedAndNeverCutOff) {
  const std::vector<CommandRequest> wrong = {
      {.device = "axis1", .operation = "zero", .valid_ms = 0},
      {.device = "axis1", .operation = "zero", .valid_ms = 3'600'001},
      {.device = std::string("axis1\0x", 7), .operation = "zero"},
      {.device = "axis1", .operation = "zero", .reason = std::string(161, 'x')},
      {.device = "axis1", .operation = "zero", .arguments = {17, {"key", "value"}}},
      {.device = "axis1", .operation = "zero", .arguments = {8, {"key", std::string(160, 'x')}}},
      {.device = "axis1", .operation = "zero", .prepare = true, .token = CommandToken{}},
  };
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    const CommandId id = Id(static_cast<int>(i));
    sessions_.Send(id, wrong[i]);
    EXPECT_EQ(Result(id).outcome(), CommandOutcome::kNotAccepted) << i;
    EXPECT_FALSE(Result(id).temporary()) << i;
  }
  static_cast<void>(sessions_.Poll());
  EXPECT_TRUE(sink_.All<command_t>("COMMAND").empty());
}

TEST_F(CommandSessionsTest, TheNewestThatEndedAreKept) {
  const int many = static_cast<int>(CommandSessions::kKept) + 10;
  for (int i = 0; i < many; ++i) {
    sessions_.Refuse(Id(i), "no port");
    EXPECT_EQ(sessions_.Poll(), kNever);
  }
  EXPECT_EQ(sessions_.Find({Kind::kCommand, Id(9)}), nullptr);
  EXPECT_EQ(Result(Id(10)).problem, "no port");
}

TEST_F(CommandSessionsTest, NoMoreUnderWayThanTheirNumberAllows) {
  const int maximum = static_cast<int>(CommandSessions::kMaxOpen);
  for (int i = 0; i <= maximum; ++i) sessions_.Send(Id(i), {.device = "axis1", .operation = "zero"});
  EXPECT_FALSE(sessions_.Find({Kind::kCommand, Id(maximum - 1)})->done());
  EXPECT_TRUE(Result(Id(maximum)).temporary());
}

TEST_F(CommandSessionsTest, ACommandAndAQueryForItMayBeUnderWayTogether) {
  sessions_.Send(Id(1), {.device = "axis1", .operation = "zero"});
  sessions_.Query(Id(1), Id(7));
  int told = 0;
  const auto tell = [&told](const S&) { ++told; };
  sessions_.OnStatus(Encoded(Id(1), S::STATE_SUCCEEDED), tell);
  static_cast<void>(sessions_.Poll());
  EXPECT_TRUE(sessions_.Find({Kind::kQuery, Id(1)})->done());
  EXPECT_FALSE(sessions_.Find({Kind::kCommand, Id(1)})->done());
  EXPECT_EQ(told, 0);
  sessions_.Query(Id(1), Id(8));  // once more
  EXPECT_FALSE(sessions_.Find({Kind::kQuery, Id(1)})->done());
}

TEST_F(CommandSessionsTest, WhatIsNoStatusIsIgnored) {
  sessions_.Send(Id(1), {.device = "axis1", .operation = "zero"});
  auto bytes = Encoded(Id(1), S::STATE_UNKNOWN);
  bytes.pop_back();
  sessions_.OnStatus(bytes, nullptr);
  sessions_.OnStatus({}, nullptr);
  static_cast<void>(sessions_.Poll());
  for (const command_t& sent : sink_.All<command_t>("COMMAND")) {
    EXPECT_EQ(DecodeMessage<command_body_t>(sent.body)->mode, command_body_t::MODE_QUERY);
  }
}

}  // namespace
}  // namespace axlecast
