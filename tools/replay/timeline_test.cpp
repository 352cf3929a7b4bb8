#include "tools/replay/timeline.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

constexpr MonoNs kStart = 50'000 * kSecond;             // 14 hours of uptime
constexpr std::int64_t kUtime = 1'790'000'000'000'000;  // 2026

TEST(Timeline, IsExactFarFromItsAnchor) {
  Timeline timeline(1);
  timeline.Anchor(kStart, kUtime);
  EXPECT_EQ(timeline.Due(kUtime), kStart);
  EXPECT_EQ(timeline.Due(kUtime + 1), kStart + kMicrosecond);
  EXPECT_EQ(timeline.Due(kUtime + 86'400'000'001), kStart + 86'400 * kSecond + kMicrosecond);
  EXPECT_EQ(timeline.Utime(kStart + 86'400 * kSecond), kUtime + 86'400'000'000);
}

TEST(Timeline, RunsAtItsSpeed) {
  Timeline timeline(4);
  timeline.Anchor(kStart, kUtime);
  EXPECT_EQ(timeline.Due(kUtime + 8'000'000), kStart + 2 * kSecond);
  EXPECT_EQ(timeline.Utime(kStart + kSecond), kUtime + 4'000'000);
  timeline.SetSpeed(0.5, kStart + kSecond);
  EXPECT_EQ(timeline.Utime(kStart + kSecond), kUtime + 4'000'000);
  EXPECT_EQ(timeline.Due(kUtime + 5'000'000), kStart + 3 * kSecond);
}

TEST(Timeline, StandsWhilePaused) {
  Timeline timeline(1);
  timeline.Anchor(kStart, kUtime);
  timeline.Pause(kStart + kSecond);
  EXPECT_EQ(timeline.Due(kUtime), kNever);
  EXPECT_EQ(timeline.Utime(kStart + 9 * kSecond), kUtime + 1'000'000);
  timeline.Pause(kStart + 5 * kSecond);
  timeline.Resume(kStart + 10 * kSecond);
  EXPECT_EQ(timeline.Due(kUtime + 2'000'000), kStart + 11 * kSecond);
  timeline.Resume(kStart + 20 * kSecond);
  EXPECT_EQ(timeline.Due(kUtime + 2'000'000), kStart + 11 * kSecond);
}

TEST(Timeline, HasEverythingDueAtOnceAtSpeedZero) {
  Timeline timeline(0);
  timeline.Anchor(kStart, kUtime);
  EXPECT_EQ(timeline.Due(kUtime + 1'000'000'000), kStart);
  EXPECT_EQ(timeline.Utime(kStart + kSecond), kUtime);
}

TEST(Timeline, GoesOnWithoutAGapWhereTheRecordingsClockWasSet) {
  Timeline timeline(2);
  timeline.Anchor(kStart, kUtime);
  timeline.Splice(kUtime + 10'000'000, kUtime - 3'600'000'000);
  EXPECT_EQ(timeline.Due(kUtime - 3'600'000'000), kStart + 5 * kSecond);
  EXPECT_EQ(timeline.Due(kUtime - 3'598'000'000), kStart + 6 * kSecond);
}

TEST(Timeline, StaysWithinBoundsWhateverTheTimes) {
  Timeline timeline(0.001);
  timeline.Anchor(kStart, INT64_MIN / 8);
  EXPECT_GT(timeline.Due(INT64_MAX / 8), kStart);
  EXPECT_LT(timeline.Due(INT64_MAX / 8), kNever);
  timeline.Splice(INT64_MAX / 8, INT64_MIN / 8);
  EXPECT_LT(timeline.Due(INT64_MAX / 8), kNever);
  timeline.SetSpeed(1e6, kStart);
  EXPECT_LT(timeline.Due(INT64_MIN / 8), kNever);
  EXPECT_LT(timeline.Due(INT64_MAX / 8), kNever);
}

}  // namespace
}  // namespace axlecast
