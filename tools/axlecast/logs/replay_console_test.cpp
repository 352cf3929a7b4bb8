#include "tools/axlecast/logs/replay_console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/recorder_health_t.hpp>

#include "tools/log/log_fixture.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

TEST(LiveChannels, AreThoseOfAMachinesMessages) {
  LiveChannels channels;
  EXPECT_EQ(channels.Text(), "");
  channels.On("RECORDER/main", Encoded(recorder_health_t{}));
  const std::vector<std::uint8_t> foreign(100, 'x');
  channels.On("OTHER", foreign);
  EXPECT_EQ(channels.Text(), "") << "messages of a recorder and of other programs do not count";
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

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ReplayKeys, AreTold) {
  ReplayKeys keys;
  EXPECT_THAT(keys.On(" s."), ElementsAre(ReplayKey::kPause, ReplayKey::kStep, ReplayKey::kStep));
  EXPECT_THAT(keys.On("+=-"), ElementsAre(ReplayKey::kFaster, ReplayKey::kFaster, ReplayKey::kSlower));
  EXPECT_THAT(keys.On("q\x04"), ElementsAre(ReplayKey::kQuit, ReplayKey::kQuit));
}

TEST(ReplayKeys, AreArrowsInEitherMode) {
  ReplayKeys keys;
  EXPECT_THAT(keys.On("\x1b[A\x1b[B\x1b[C\x1b[D"),
              ElementsAre(ReplayKey::kForward10, ReplayKey::kBack10, ReplayKey::kForward1, ReplayKey::kBack1));
  EXPECT_THAT(keys.On("\x1bOC\x1b[1;5D"), ElementsAre(ReplayKey::kForward1, ReplayKey::kBack1));
}

TEST(ReplayKeys, MayComeInPieces) {
  ReplayKeys keys;
  EXPECT_THAT(keys.On("\x1b"), IsEmpty());
  EXPECT_THAT(keys.On("["), IsEmpty());
  EXPECT_THAT(keys.On("C"), ElementsAre(ReplayKey::kForward1));
}

TEST(ReplayKeys, PassOverOthers) {
  ReplayKeys keys;
  EXPECT_THAT(keys.On("xyz\x1b[5~\x1b[H\x1bx\r\n\xc3\xa4"), IsEmpty());
  EXPECT_THAT(keys.On("\x1b\x1b[C"), ElementsAre(ReplayKey::kForward1));
  EXPECT_THAT(keys.On("\x1b[" + std::string(1'000, '1')), IsEmpty());
  EXPECT_THAT(keys.On("\x1b[1 q"), testing::Not(testing::Contains(ReplayKey::kPause)));
  EXPECT_THAT(keys.On("q"), testing::Contains(ReplayKey::kQuit));
}

using testing::HasSubstr;
using testing::Not;

constexpr std::int64_t kS = 1'000'000;
constexpr std::int64_t kBegin = 1'790'000'000 * kS;  // 2026-09-21 14:13:20 UTC

class ReplayTextTest : public testing::Test {
 protected:
  ReplayTextTest() : replay_({log_.bytes()}, FindRange({log_.bytes()}, {}), {}, {.speed = 4}, 0) {}

  void PlayUntil(MonoNs end) {
    while (replay_.Due() <= end) static_cast<void>(replay_.Take(end));
  }

  const RecordedLog log_ =
      RecordedLog().Add(kBegin, "a").AddDamage(9).Add(kBegin + 1 * kS, "COMMAND").Add(kBegin + 20 * kS, "b");
  Replay replay_;
};

TEST_F(ReplayTextTest, ProgressTellsWhereItIsWithin80Columns) {
  PlayUntil(kSecond);
  EXPECT_EQ(ReplayProgress(replay_, kSecond), "[====>               ] 4.0/20.0 s  2026-09-21 14:13:24  x4  1");
  replay_.SetSpeed(0, kSecond);
  replay_.Pause(kSecond);
  const std::string line = ReplayProgress(replay_, kSecond);
  EXPECT_THAT(line, HasSubstr("fast  1  paused"));
  EXPECT_LE(line.size(), 80U);
}

TEST_F(ReplayTextTest, SummaryTellsWhatWasNotPlayed) {
  PlayUntil(kSecond);
  const std::string summary = ReplaySummary(replay_, {.stopped = true, .unsent = 2, .seconds = 1});
  EXPECT_THAT(summary, HasSubstr("1 messages played in 1.000 s, then stopped\n"));
  EXPECT_THAT(summary, HasSubstr("held back: 1 messages"));
  EXPECT_THAT(summary, HasSubstr("skipped: 1 damaged regions, 9 bytes"));
  EXPECT_THAT(summary, HasSubstr("not sent: 2 messages"));
  EXPECT_THAT(summary, Not(HasSubstr("held up")));
}

TEST_F(ReplayTextTest, TellsOfALogThatIsGone) {
  const ReplayOutcome outcome{.stopped = true, .loss = "a.log was made shorter", .seconds = 1};
  const std::string summary = ReplaySummary(replay_, outcome);
  EXPECT_THAT(summary, HasSubstr("played in 1.000 s, up to where the log was lost\n"));
  EXPECT_THAT(summary, HasSubstr("a.log was made shorter\n"));
  EXPECT_EQ(ReplayJson(replay_, outcome)["ended"], "lost");
}

TEST_F(ReplayTextTest, JsonHoldsTheFigures) {
  PlayUntil(kSecond);
  PlayUntil(5 * kSecond);
  const auto json = ReplayJson(replay_, {.seconds = 5, .late_p99_us = 80});
  EXPECT_EQ(json["ended"], "end");
  EXPECT_EQ(json["played"], 2);
  EXPECT_EQ(json["held_back"], 1);
  EXPECT_EQ(json["damaged_regions"], 1);
  EXPECT_EQ(json["damaged_bytes"], 9);
  EXPECT_EQ(json["late_p99_us"], 80);
  EXPECT_EQ(json["begin_utime"], kBegin);
}

}  // namespace

}  // namespace axlecast
