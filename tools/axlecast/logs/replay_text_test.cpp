#include "tools/axlecast/logs/replay_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

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
