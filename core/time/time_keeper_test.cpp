#include "core/time/time_keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using Q = time_quality_t;
constexpr std::int64_t kBase = 77;

// A host whose CLOCK_MONOTONIC_RAW is the test's time, and whose base is `ahead` of it.
class Host {
 public:
  explicit Host(std::int64_t own_base_id = 0) : keeper_({}, own_base_id) {}

  void Pass(MonoNs time) {
    for (const MonoNs end = now_ + time; now_ < end;) {
      now_ += 100 * kMillisecond;
      mono_ += 100 * kMillisecond + mono_gains;
      boot_ += 100 * kMillisecond + mono_gains;
      if (answered) static_cast<void>(Exchange());
      Read();
    }
  }
  void Read() { keeper_.OnClocks({now_, mono_, boot_, now_ + 40}); }
  bool Exchange() {
    return keeper_.OnExchange(
        {now_ - 300 * kMicrosecond, now_, now_ + ahead - 200 * kMicrosecond, now_ + ahead - 190 * kMicrosecond},
        base_id);
  }
  void Suspend(MonoNs time) { boot_ += time; }
  [[nodiscard]] time_quality_t Quality() const {
    time_quality_t quality{};
    keeper_.Describe(quality);
    return quality;
  }
  [[nodiscard]] MonoNs Truth() const { return now_ + ahead; }
  TimeKeeper& keeper() { return keeper_; }

  bool answered = true;
  MonoNs ahead = 5 * kSecond;
  std::int64_t base_id = kBase;
  MonoNs mono_gains = 0;  // in 100 ms

 private:
  MonoNs now_ = 1'000 * kSecond;
  MonoNs mono_ = 3 * kSecond;
  MonoNs boot_ = 3 * kSecond;
  TimeKeeper keeper_;
};

MATCHER_P(Holds, truth, "") {
  return arg.half_width_ns >= 0 && arg.base_ns - arg.half_width_ns <= truth &&
         truth <= arg.base_ns + arg.half_width_ns;
}

TEST(TimeKeeper, ClaimsNothingBeforeAnExchange) {
  Host host;
  host.answered = false;
  host.Pass(kSecond);
  EXPECT_EQ(host.Quality().state, Q::STATE_STARTING);
  EXPECT_EQ(host.Quality().grade, Q::GRADE_NONE);
  EXPECT_EQ(host.Quality().half_width_ns, -1);
  EXPECT_EQ(host.Quality().reason, "no answer of the root yet");
}

TEST(TimeKeeper, ClaimsAnIntervalThatHoldsTheBase) {
  Host host;
  host.Pass(kSecond);
  const time_quality_t quality = host.Quality();
  EXPECT_EQ(quality.state, Q::STATE_SYNCHRONISED);
  EXPECT_EQ(quality.grade, Q::GRADE_PROVEN);
  EXPECT_EQ(quality.source, Q::SOURCE_EXCHANGE);
  EXPECT_EQ(quality.base, Q::BASE_ROOT);
  EXPECT_EQ(quality.base_id, kBase);
  EXPECT_EQ(quality.rtt_min_ns, 300 * kMicrosecond);
  EXPECT_THAT(quality, Holds(host.Truth()));
  EXPECT_LT(quality.half_width_ns, 160 * kMicrosecond) << "half of what the network took";
  EXPECT_EQ(quality.reason, "");
}

TEST(TimeKeeper, TheRootNeedsNoExchange) {
  Host host(kBase);
  host.ahead = 0;
  host.answered = false;
  host.Pass(kSecond);
  const time_quality_t quality = host.Quality();
  EXPECT_EQ(quality.source, Q::SOURCE_SELF);
  EXPECT_EQ(quality.state, Q::STATE_SYNCHRONISED);
  EXPECT_THAT(quality, Holds(host.Truth()));
  EXPECT_LE(quality.half_width_ns, 20);
  EXPECT_FALSE(host.Exchange()) << "an answer to the root is nobody's";
}

TEST(TimeKeeper, WithdrawsTheClaimAfterACut) {
  Host host;
  host.Pass(kSecond);
  host.answered = false;
  host.Pass(TimeKeeper::kHoldover + 100 * kMillisecond);
  EXPECT_EQ(host.Quality().state, Q::STATE_HOLDOVER);
  EXPECT_THAT(host.Quality(), Holds(host.Truth()));
  host.Pass(TimeKeeper::kLost - TimeKeeper::kHoldover);
  EXPECT_EQ(host.Quality().state, Q::STATE_LOST);
  EXPECT_EQ(host.Quality().half_width_ns, -1);
  EXPECT_EQ(host.Quality().reason, "no answer of the root");
  host.answered = true;
  host.Pass(kSecond);
  EXPECT_EQ(host.Quality().state, Q::STATE_SYNCHRONISED);
  EXPECT_THAT(host.Quality(), Holds(host.Truth()));
  EXPECT_EQ(host.Quality().epoch, 0) << "nothing broke meanwhile";
}

TEST(TimeKeeper, AStepOfABaseBeginsAnEpochWithoutAClaim) {
  Host host;
  host.Pass(kSecond);
  host.ahead += 3 * kSecond;
  host.Pass(100 * kMillisecond);
  EXPECT_EQ(host.Quality().state, Q::STATE_LOST);
  EXPECT_EQ(host.Quality().epoch, 1);
  EXPECT_THAT(host.Quality().reason, testing::HasSubstr("a clock was stepped or paused"));
  host.Pass(TimeKeeper::kDoubt);
  EXPECT_THAT(host.Quality(), Holds(host.Truth()));
  EXPECT_EQ(host.Quality().epoch, 1);
}

TEST(TimeKeeper, ALimitThatIsExceededAgainIsDoubtedForLonger) {
  constexpr MonoNs kCycle = 100 * kMillisecond;
  Host host;
  host.Pass(kSecond);
  for (const MonoNs doubt : {2 * kSecond, 4 * kSecond, 8 * kSecond}) {
    host.ahead += 3 * kSecond;
    host.Pass(doubt - kCycle);  // the doubt begins with the reading of the clocks before the exchange
    EXPECT_EQ(host.Quality().half_width_ns, -1) << doubt;
    host.Pass(kCycle);
    EXPECT_THAT(host.Quality(), Holds(host.Truth())) << doubt;
  }
  host.Pass(TimeKeeper::kForgotten);
  host.ahead += 3 * kSecond;
  host.Pass(kCycle + TimeKeeper::kDoubt);
  EXPECT_THAT(host.Quality(), Holds(host.Truth())) << "the first time in five minutes";
}

TEST(TimeKeeper, AnotherRootBeginsAnEpoch) {
  Host host;
  host.Pass(kSecond);
  host.base_id = kBase + 1;
  host.ahead = 9 * kSecond;
  host.Pass(100 * kMillisecond);
  EXPECT_EQ(host.Quality().half_width_ns, -1);
  EXPECT_EQ(host.Quality().epoch, 1);
  host.Pass(TimeKeeper::kDoubt);
  EXPECT_THAT(host.Quality(), Holds(host.Truth()));
  EXPECT_EQ(host.Quality().base_id, kBase + 1);
}

TEST(TimeKeeper, ASuspensionBeginsAnEpoch) {
  Host host;
  host.Pass(kSecond);
  host.Suspend(kSecond);
  host.Pass(100 * kMillisecond);
  EXPECT_EQ(host.Quality().half_width_ns, -1);
  EXPECT_EQ(host.Quality().reason, "the host was suspended");
}

TEST(TimeKeeper, ASlewWithinTheLimitIsInTheGrowth) {
  Host host;
  host.mono_gains = 95 * kMicrosecond;  // 950 ppm
  host.Pass(kSecond);
  EXPECT_THAT(host.Quality(), Holds(host.Truth()));
  EXPECT_EQ(host.Quality().growth_ppb, 1'100'000);
}

TEST(TimeKeeper, AFasterSlewEndsTheClaim) {
  Host host;
  host.Pass(kSecond);
  host.mono_gains = 8 * kMillisecond;  // chrony's fastest
  host.Pass(100 * kMillisecond);
  EXPECT_EQ(host.Quality().half_width_ns, -1);
  EXPECT_THAT(host.Quality().reason, testing::HasSubstr("max_slew_ppm"));
}

TEST(TimeKeeper, AnImpossibleAnswerIsNotUsed) {
  Host host;
  host.Pass(kSecond);
  const time_quality_t before = host.Quality();
  const MonoNs now = 1'002 * kSecond;
  EXPECT_FALSE(host.keeper().OnExchange({now, now - 1, 0, 0}, kBase)) << "received before it was sent";
  EXPECT_FALSE(host.keeper().OnExchange({now, now + 1, 9, 8}, kBase)) << "answered before it was asked";
  EXPECT_FALSE(host.keeper().OnExchange({now, now + 1, 0, kSecond}, kBase))
      << "the root took longer than the exchange";
  EXPECT_FALSE(host.keeper().OnExchange({now, INT64_MAX, 0, 0}, kBase));
  EXPECT_FALSE(host.keeper().OnExchange({now, now + 1, INT64_MIN, 0}, kBase));
  EXPECT_EQ(host.Quality().half_width_ns, before.half_width_ns);
  EXPECT_EQ(host.Quality().exchanges, before.exchanges);
}

// A root that answers slowly costs no width: what it took is known.
TEST(OffsetBound, DoesNotCountTheTimeOfTheRoot) {
  OffsetBound bound(100'000);
  EXPECT_TRUE(bound.Add({0, 10 * kMillisecond + 200, 1'000'100, 1'000'100 + 10 * kMillisecond}));
  const auto range = bound.At(10 * kMillisecond + 200);
  ASSERT_TRUE(range);
  EXPECT_LE(range->lowest, 1'000'000);
  EXPECT_GE(range->highest, 1'000'000);
  EXPECT_LT(range->highest - range->lowest, 10 * kMicrosecond);
}

TEST(OffsetBound, GrowsWithTheLimitOfTheRates) {
  OffsetBound bound(100'000);
  EXPECT_TRUE(bound.Add({0, 100, 50, 50}));
  const auto range = bound.At(100 * kSecond);
  ASSERT_TRUE(range);
  EXPECT_NEAR(static_cast<double>(range->highest), 10e6, 1e3) << "100 ppm of 100 s";
  EXPECT_NEAR(static_cast<double>(range->lowest), -10e6, 1e3);
}

}  // namespace
}  // namespace axlecast
