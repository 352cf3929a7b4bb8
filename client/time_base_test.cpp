#include <axlecast/time_base.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using Answer = TimeBase::Answer;

constexpr std::int64_t kMs = 1'000'000;

// A host whose clock is behind the base by `base_ahead`.
struct Publisher {
  std::int64_t clock_id = 1;
  std::int64_t base_ahead = 0;
  std::int64_t base_id = 9;
  std::int64_t boot_id = 3;
  std::int32_t epoch = 0;
  std::int64_t half_width = 100'000;

  [[nodiscard]] time_quality_t At(std::int64_t mono) const {
    time_quality_t message{};
    message.clock_id = clock_id;
    message.boot_id = boot_id;
    message.mono_ns = mono;
    message.base_ns = mono + base_ahead;
    message.base_id = base_id;
    message.half_width_ns = half_width;
    message.grade = half_width < 0 ? time_quality_t::GRADE_NONE : time_quality_t::GRADE_PROVEN;
    message.growth_ppb = 600'000;
    message.valid_ms = 1'000;
    message.epoch = epoch;
    return message;
  }
};

Publisher Host(std::int64_t clock_id, std::int64_t base_ahead = 0) {
  Publisher host;
  host.clock_id = clock_id;
  host.base_ahead = base_ahead;
  return host;
}

TEST(TimeBase, ConvertsToTheBaseWithAnIntervalThatGrows) {
  TimeBase time;
  const Publisher host = Host(1, 7'000 * kMs);
  EXPECT_EQ(time.OnBase(1, 100 * kMs, 0).answer, Answer::kNoTime);
  time.OnTime(host.At(100 * kMs), 0);
  const auto at = time.OnBase(1, 110 * kMs, 0);
  ASSERT_TRUE(at);
  EXPECT_EQ(at.ns, 7'110 * kMs);
  EXPECT_GE(at.half_width_ns, 106'000);
  EXPECT_LT(at.half_width_ns, 107'000);
  EXPECT_EQ(at.base_id, 9);
  EXPECT_EQ(time.OnBase(1, 1'101 * kMs, 0).answer, Answer::kExpired);
  EXPECT_EQ(time.OnBase(1, 99 * kMs, 0).answer, Answer::kExpired) << "before the first message";
}

TEST(TimeBase, AHostThatFallsSilentIsNotExtrapolated) {
  TimeBase time;
  time.OnTime(Publisher{}.At(100 * kMs), 5'000 * kMs);
  EXPECT_TRUE(time.OnBase(1, 110 * kMs, 5'999 * kMs));
  EXPECT_EQ(time.OnBase(1, 110 * kMs, 6'001 * kMs).answer, Answer::kExpired) << "it may have been suspended";
}

TEST(TimeBase, BetweenTwoMessagesBothBind) {
  TimeBase time;
  Publisher host;
  time.OnTime(host.At(100 * kMs), 0);
  time_quality_t later = host.At(200 * kMs);
  later.base_ns += 150'000;  // its interval is [50 us, 250 us] ahead, the first one's is [-100 us, 100 us]
  time.OnTime(later, 0);
  const auto at = time.OnBase(1, 150 * kMs, 0);
  ASSERT_TRUE(at);
  EXPECT_LT(at.half_width_ns, 60'000);
  EXPECT_NEAR(static_cast<double>(at.ns - 150 * kMs), 75'000, 1'000);
}

TEST(TimeBase, AnEpochThatEndsTakesItsInstantsAlong) {
  TimeBase time;
  Publisher host;
  time.OnTime(host.At(100 * kMs), 0);
  host.epoch = 1;
  time.OnTime(host.At(200 * kMs), 0);
  EXPECT_EQ(time.OnBase(1, 150 * kMs, 0).answer, Answer::kEpochChanged);
  EXPECT_TRUE(time.OnBase(1, 210 * kMs, 0));
  host.boot_id = 4;
  time.OnTime(host.At(300 * kMs), 0);
  EXPECT_EQ(time.OnBase(1, 250 * kMs, 0).answer, Answer::kEpochChanged) << "another process";
}

TEST(TimeBase, AClaimThatIsWithdrawnEndsAtOnce) {
  TimeBase time;
  Publisher host;
  time.OnTime(host.At(100 * kMs), 0);
  host.half_width = -1;
  time.OnTime(host.At(200 * kMs), 0);
  EXPECT_EQ(time.OnBase(1, 201 * kMs, 0).answer, Answer::kNoClaim);
  EXPECT_TRUE(time.OnBase(1, 199 * kMs, 0)) << "the claim before it still holds of earlier instants";
}

TEST(TimeBase, ConvertsFromClockToClock) {
  TimeBase time;
  Publisher here = Host(1, -50 * kMs);
  here.half_width = 20;
  const Publisher there = Host(2, 9'000 * kMs);
  time.OnTime(here.At(9'160 * kMs), 0);
  time.OnTime(there.At(100 * kMs), 0);
  const auto at = time.OnClock(1, 2, 110 * kMs, 0);
  ASSERT_TRUE(at);
  EXPECT_EQ(at.ns, 9'160 * kMs);
  EXPECT_LT(at.half_width_ns, 108'000);
  EXPECT_TRUE(time.OnClock(7, 7, 5, 0)) << "the same clock needs no message";
  EXPECT_EQ(time.OnClock(7, 2, 110 * kMs, 0).answer, Answer::kNoTime);
}

TEST(TimeBase, DifferentRootsAreNotCompared) {
  TimeBase time;
  Publisher other = Host(2);
  other.base_id = 8;
  time.OnTime(Host(1).At(100 * kMs), 0);
  time.OnTime(other.At(100 * kMs), 0);
  EXPECT_EQ(time.OnClock(1, 2, 100 * kMs, 0).answer, Answer::kDifferentBase);
  EXPECT_FALSE(TimeBase::Before(time.OnBase(1, 100 * kMs, 0), time.OnBase(2, 900 * kMs, 0)));
}

TEST(TimeBase, AnOrderIsKnownOnlyIfTheIntervalsAreApart) {
  TimeBase time;
  time.OnTime(Publisher{}.At(100 * kMs), 0);
  const auto first = time.OnBase(1, 100 * kMs, 0);
  EXPECT_FALSE(TimeBase::Before(first, time.OnBase(1, 100 * kMs + 150'000, 0)));
  EXPECT_TRUE(TimeBase::Before(first, time.OnBase(1, 101 * kMs, 0)));
  EXPECT_FALSE(TimeBase::Before(time.OnBase(1, 101 * kMs, 0), first));
}

TEST(TimeBase, MessagesOfAnotherMachineAndNonsenseAreIgnored) {
  TimeBase time(5);
  time_quality_t message = Publisher{}.At(100 * kMs);
  message.machine_id = 6;
  time.OnTime(message, 0);
  message.machine_id = 5;
  for (const std::int64_t wild : {INT64_MIN, std::int64_t{-1}, INT64_MAX}) {
    time_quality_t bad = message;
    bad.mono_ns = wild;
    time.OnTime(bad, 0);
    bad = message;
    bad.base_ns = wild;
    time.OnTime(bad, 0);
    bad = message;
    bad.half_width_ns = wild == -1 ? -2 : wild;
    time.OnTime(bad, 0);
  }
  EXPECT_EQ(time.OnBase(1, 100 * kMs, 0).answer, Answer::kNoTime);
  time.OnTime(message, 0);
  EXPECT_TRUE(time.OnBase(1, 100 * kMs, 0));
  EXPECT_EQ(time.OnBase(1, INT64_MAX, 0).answer, Answer::kExpired);
  EXPECT_EQ(time.OnBase(1, INT64_MIN, 0).answer, Answer::kExpired);
  EXPECT_EQ(time.OnClock(1, 1, INT64_MAX, 0).ns, INT64_MAX);
}

TEST(TimeBase, ManyClocksDisplaceTheOneThatWasSilentLongest) {
  TimeBase time;
  for (std::int64_t id = 1; id <= static_cast<std::int64_t>(TimeBase::kClocks) + 1; ++id) {
    time.OnTime(Host(id).At(100 * kMs), 0);
  }
  EXPECT_EQ(time.OnBase(1, 100 * kMs, 0).answer, Answer::kNoTime);
  EXPECT_TRUE(time.OnBase(2, 100 * kMs, 0));
}

}  // namespace
}  // namespace axlecast
