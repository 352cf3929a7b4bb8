#include "tests/time_guests/clock_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using Clock = ClockLog::Clock;

constexpr CpuTicks kPerMillisecond = 2'000'000;  // a counter of 2 GHz

// CLOCK_MONOTONIC_RAW is the counter's time plus 5 s. CLOCK_MONOTONIC runs 200 ppm faster from `faster_from` on.
struct Truth {
  CpuTicks faster_from = INT64_MAX / 4;

  [[nodiscard]] std::int64_t Raw(CpuTicks ticks) const { return 5'000'000'000 + ticks / 2; }
  [[nodiscard]] std::int64_t Mono(CpuTicks ticks) const {
    return Raw(ticks) + (ticks > faster_from ? (ticks - faster_from) / 2 / 5'000 : 0);
  }
};

// Readings each 10 ms, whose brackets are 400 ticks wide: the clocks are read anywhere within them.
ClockLog Read(const Truth& truth, int count = 100) {
  ClockLog log;
  for (int i = 0; i < count; ++i) {
    const CpuTicks before = i * 10 * kPerMillisecond;
    const CpuTicks read = before + 13 * i % 400;
    log.Add({before, truth.Mono(read), truth.Raw(read), 0, before + 400});
  }
  return log;
}

MATCHER_P(Contains, value, "") { return arg && arg->lowest <= value && value <= arg->highest; }

TEST(ClockLog, BoundsAClockBetweenReadings) {
  const Truth truth;
  const ClockLog log = Read(truth);
  for (CpuTicks ticks = 7 * kPerMillisecond; ticks < 900 * kPerMillisecond; ticks += 12'345'677) {
    const auto raw = log.At(Clock::kRaw, {ticks, ticks});
    ASSERT_THAT(raw, Contains(truth.Raw(ticks)));
    EXPECT_LT(raw->highest - raw->lowest, 600);
    const auto back = log.When(Clock::kRaw, truth.Raw(ticks));
    ASSERT_THAT(back, Contains(ticks));
    EXPECT_LT(back->highest - back->lowest, 1'200);
  }
}

TEST(ClockLog, BoundsAClockWhoseRateChanges) {
  const Truth truth{.faster_from = 503 * kPerMillisecond};
  const ClockLog log = Read(truth);
  for (CpuTicks ticks = 400 * kPerMillisecond; ticks < 600 * kPerMillisecond; ticks += 123'457) {
    EXPECT_THAT(log.At(Clock::kMono, {ticks, ticks}), Contains(truth.Mono(ticks)));
    EXPECT_THAT(log.When(Clock::kMono, truth.Mono(ticks)), Contains(ticks));
  }
}

TEST(ClockLog, WidensWithTheInstant) {
  const Truth truth;
  const ClockLog log = Read(truth);
  const CpuTicks ticks = 333 * kPerMillisecond;
  const auto wide = log.At(Clock::kRaw, {ticks - 50 * kPerMillisecond, ticks + 50 * kPerMillisecond});
  EXPECT_THAT(wide, Contains(truth.Raw(ticks - 50 * kPerMillisecond)));
  EXPECT_THAT(wide, Contains(truth.Raw(ticks + 50 * kPerMillisecond)));
}

TEST(ClockLog, KnowsNothingOutsideOfTheReadings) {
  const Truth truth;
  const ClockLog log = Read(truth);
  EXPECT_FALSE(log.At(Clock::kRaw, {-10, -10}));
  EXPECT_FALSE(log.At(Clock::kRaw, {990 * kPerMillisecond, 991 * kPerMillisecond}));
  EXPECT_FALSE(log.When(Clock::kRaw, truth.Raw(-10)));
  EXPECT_FALSE(log.When(Clock::kRaw, truth.Raw(991 * kPerMillisecond)));
  EXPECT_FALSE(ClockLog().At(Clock::kRaw, {0, 0}));
}

TEST(ClockLog, FindsHowLongTheHostWasStarved) {
  const Truth truth;
  ClockLog log = Read(truth);
  const CpuTicks late = (990 + 250) * kPerMillisecond;
  log.Add({late, truth.Mono(late), truth.Raw(late), 0, late + 10});
  EXPECT_NEAR(static_cast<double>(log.LongestGap(0, 500 * kPerMillisecond)), 10e6, 1e3);
  EXPECT_NEAR(static_cast<double>(log.LongestGap(0, 2'000 * kPerMillisecond)), 250e6, 1e3);
}

}  // namespace
}  // namespace axlecast
