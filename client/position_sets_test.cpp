#include <axlecast/position_sets.h>

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace axlecast {
namespace {

constexpr std::int64_t kUs = 1'000;
constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kClock = 7;

using Set = position_set_t;
using OneAxis = position_set_axis_t;

PositionSetBuilder::Options TwoAxes() {
  PositionSetBuilder::Options options;
  options.name = "gantry";
  options.axes = {{"x", 1}, {"y", 1}};
  options.period_ns = kMs;
  options.limit_ns = 100 * kUs;
  return options;
}

// A reading on tick `tick` of 1 kHz, sampled `after_us` after it, known to +- 10 us.
position_t Reading(std::int64_t tick, std::int64_t after_us, std::int64_t boot_id = 1) {
  position_t message{};
  message.boot_id = boot_id;
  message.clock_id = kClock;
  message.tick = tick;
  message.mono_ns = tick * kMs + after_us * kUs;
  message.time_uncertainty_ns = 10 * kUs;
  message.counts = 100 * tick + after_us;
  message.flags = position_t::FLAG_VALID;
  return message;
}

TEST(PositionSets, StateHowFarApartTheAxesWereSampled) {
  PositionSetBuilder sets(TwoAxes());
  sets.OnPosition(0, Reading(5, 3), 6 * kMs);
  EXPECT_EQ(sets.Next(6 * kMs), nullptr) << "y is missing";
  sets.OnPosition(1, Reading(5, -20), 6 * kMs);
  const Set* set = sets.Next(6 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->set, "gantry");
  EXPECT_EQ(set->tick, 5);
  EXPECT_EQ(set->tick_ns, 5 * kMs);
  EXPECT_EQ(set->base_id, 0);
  EXPECT_EQ(set->state, Set::STATE_ALIGNED);
  EXPECT_EQ(set->earliest_ns, 5 * kMs - 30 * kUs);
  EXPECT_EQ(set->latest_ns, 5 * kMs + 13 * kUs);
  ASSERT_EQ(set->n, 2);
  EXPECT_EQ(set->axes[1].device, "y");
  EXPECT_EQ(set->axes[1].offset_ns, -20 * kUs);
  EXPECT_EQ(set->axes[1].half_width_ns, 10 * kUs);
  EXPECT_EQ(set->axes[0].counts, 503);
  EXPECT_EQ(sets.Next(6 * kMs), nullptr);
}

TEST(PositionSets, AreNotAlignedIfTheHullIsWiderThanTheLimit) {
  PositionSetBuilder sets(TwoAxes());
  sets.OnPosition(0, Reading(5, 0), 6 * kMs);
  sets.OnPosition(1, Reading(5, 81), 6 * kMs);
  const Set* set = sets.Next(6 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->state, Set::STATE_NOT_ALIGNED) << "-10 us to 91 us are 101 us";
}

TEST(PositionSets, WaitForAMissingAxisUntilItCannotComeAnyMore) {
  PositionSetBuilder sets(TwoAxes());
  sets.OnPosition(0, Reading(5, 0), 6 * kMs);
  EXPECT_EQ(sets.NextAt(), 26 * kMs);
  EXPECT_EQ(sets.Next(25 * kMs), nullptr);
  const Set* set = sets.Next(26 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->state, Set::STATE_INCOMPLETE);
  EXPECT_EQ(set->axes[1].state, OneAxis::STATE_MISSING);
  sets.OnPosition(1, Reading(5, 0), 27 * kMs);
  EXPECT_EQ(sets.totals().late, 1);
  EXPECT_EQ(sets.Next(90 * kMs), nullptr);

  sets.OnPosition(0, Reading(100, 0), 100 * kMs);
  sets.OnPosition(0, Reading(101, 0), 101 * kMs);
  sets.OnPosition(1, Reading(101, 0), 101 * kMs);  // y has passed over tick 100
  set = sets.Next(101 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->tick, 100);
  EXPECT_EQ(set->state, Set::STATE_INCOMPLETE);
  set = sets.Next(101 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->tick, 101);
  EXPECT_EQ(set->state, Set::STATE_ALIGNED);
}

TEST(PositionSets, ComeInTheOrderOfTheirTicks) {
  PositionSetBuilder sets(TwoAxes());
  std::vector<std::int64_t> ticks;
  for (const std::int64_t tick : {8, 6, 7}) sets.OnPosition(0, Reading(tick, 0), 9 * kMs);
  for (const std::int64_t tick : {6, 7, 8}) sets.OnPosition(1, Reading(tick, 0), 9 * kMs);
  while (const Set* set = sets.Next(9 * kMs)) ticks.push_back(set->tick);
  EXPECT_EQ(ticks, (std::vector<std::int64_t>{6, 7, 8}));
}

TEST(PositionSets, WithAnAxisThatIsNotValidAreIncomplete) {
  PositionSetBuilder sets(TwoAxes());
  position_t doubtful = Reading(5, 0);
  doubtful.flags = 0;
  sets.OnPosition(0, doubtful, 6 * kMs);
  sets.OnPosition(1, Reading(5, 500), 6 * kMs);
  const Set* set = sets.Next(6 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->state, Set::STATE_INCOMPLETE);
  EXPECT_EQ(set->axes[0].state, OneAxis::STATE_NOT_VALID);
  EXPECT_EQ(set->earliest_ns, 5 * kMs + 490 * kUs) << "the hull is that of the good axes";
}

TEST(PositionSets, OfTwoDriversForOneDeviceAreNotValid) {
  PositionSetBuilder sets(TwoAxes());
  sets.OnPosition(0, Reading(5, 0, 1), 6 * kMs);
  sets.OnPosition(0, Reading(5, 0, 2), 6 * kMs);
  sets.OnPosition(1, Reading(5, 0), 6 * kMs);
  const Set* set = sets.Next(6 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->axes[0].state, OneAxis::STATE_NOT_VALID);
}

TEST(PositionSets, DoNotCompareTheClocksOfTwoHosts) {
  PositionSetBuilder sets(TwoAxes());
  position_t elsewhere = Reading(5, 0);
  elsewhere.clock_id = kClock + 1;
  sets.OnPosition(0, Reading(5, 0), 6 * kMs);
  sets.OnPosition(1, elsewhere, 6 * kMs);
  const Set* set = sets.Next(6 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->state, Set::STATE_INCOMPLETE);
  EXPECT_EQ(set->axes[1].state, OneAxis::STATE_TIME_UNKNOWN);
}

TEST(PositionSets, CountMessagesWithoutATick) {
  PositionSetBuilder::Options options = TwoAxes();
  options.axes[1].ticks = 10;
  options.machine_id = 3;
  PositionSetBuilder sets(options);
  sets.OnPosition(0, Reading(-1, 0), 6 * kMs);
  sets.OnPosition(1, Reading(51, 0), 6 * kMs);
  EXPECT_EQ(sets.totals().no_tick, 2);
  position_t other = Reading(5, 0);
  other.machine_id = 4;
  sets.OnPosition(0, other, 6 * kMs);
  sets.OnPosition(2, Reading(5, 0), 6 * kMs);
  EXPECT_EQ(sets.Next(kMs * 1'000), nullptr)
      << "neither of another machine, nor of an axis that the set does not have";
  sets.OnPosition(1, Reading(50, 0), 6 * kMs);
  const Set* set = sets.Next(kMs * 1'000);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->tick, 5);
}

TEST(PositionSets, IgnoreAbsurdNumbers) {
  PositionSetBuilder sets(TwoAxes());
  for (const std::int64_t wild : {INT64_MIN, INT64_MAX, INT64_MAX / 2}) {
    position_t message = Reading(5, 0);
    message.tick = wild;
    sets.OnPosition(0, message, 6 * kMs);
    message = Reading(5, 0);
    message.mono_ns = wild;
    sets.OnPosition(0, message, 6 * kMs);
  }
  position_t message = Reading(5, 0);
  message.time_uncertainty_ns = INT32_MIN;
  sets.OnPosition(0, message, 6 * kMs);
  EXPECT_EQ(sets.totals().no_tick, 7);
  message = Reading(5, 0);
  message.mono_ns = 1'000'000 * kMs;  // possible, but far from its tick
  sets.OnPosition(0, message, 6 * kMs);
  sets.OnPosition(1, Reading(5, 0), 6 * kMs);
  const Set* set = sets.Next(6 * kMs);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->axes[0].state, OneAxis::STATE_TIME_UNKNOWN);
}

TEST(PositionSets, BeginAgainWithTheTicksOfAnotherBase) {
  PositionSetBuilder sets(TwoAxes());
  for (const std::int64_t tick : {1'000'000, 5}) {
    sets.OnPosition(0, Reading(tick, 0), 6 * kMs);
    sets.OnPosition(1, Reading(tick, 0), 6 * kMs);
    const Set* set = sets.Next(6 * kMs);
    ASSERT_NE(set, nullptr);
    EXPECT_EQ(set->tick, tick);
  }
}

TEST(PositionSets, StayBoundedWithoutOneOfTheAxes) {
  PositionSetBuilder sets(TwoAxes());
  std::int64_t closed = 0;
  for (std::int64_t tick = 0; tick < 1'000; ++tick) {
    sets.OnPosition(0, Reading(tick, 0), kMs);
    while (const Set* set = sets.Next(kMs)) closed += set->n == 2 ? 1 : 0;
  }
  EXPECT_GE(closed, 1'000 - static_cast<std::int64_t>(PositionSetBuilder::kOpen));
}

// TIME of a host whose clock is `behind` the base, known to +- 20 us.
time_quality_t Time(std::int64_t clock_id, std::int64_t mono, std::int64_t behind) {
  time_quality_t message{};
  message.clock_id = clock_id;
  message.mono_ns = mono;
  message.base_id = 9;
  message.base_ns = mono + behind;
  message.half_width_ns = 20 * kUs;
  message.valid_ms = 1'000;
  message.grade = time_quality_t::GRADE_PROVEN;
  return message;
}

TEST(PositionSets, OfTwoHostsAreOnTheTimeBase) {
  constexpr std::int64_t kBehind = 5'000 * kMs;
  TimeBase time;
  time.OnTime(Time(kClock, 5 * kMs, 0), 0);
  time.OnTime(Time(kClock + 1, 5 * kMs + kBehind, -kBehind), 0);
  PositionSetBuilder::Options options = TwoAxes();
  options.one_host = false;
  options.time = &time;
  PositionSetBuilder sets(options);
  position_t there = Reading(5, 30);
  there.clock_id = kClock + 1;
  there.mono_ns += kBehind;
  sets.OnPosition(0, Reading(5, 0), 0);
  sets.OnPosition(1, there, 0);
  const Set* set = sets.Next(0);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->state, Set::STATE_ALIGNED);
  EXPECT_EQ(set->base_id, 9);
  EXPECT_NEAR(set->axes[1].offset_ns, 30 * kUs, 5);
  EXPECT_NEAR(set->axes[1].half_width_ns, 30 * kUs, 5) << "of the reading and of the base";
  EXPECT_NEAR(static_cast<double>(set->latest_ns - set->earliest_ns), 90.0 * kUs, 10);

  there.tick = 6;
  there.mono_ns = 900'000 * kMs;  // no TIME message is near
  sets.OnPosition(0, Reading(6, 0), 0);
  sets.OnPosition(1, there, 0);
  set = sets.Next(0);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->axes[1].state, OneAxis::STATE_TIME_UNKNOWN);
  EXPECT_EQ(set->axes[1].half_width_ns, -1);
}

// The base widens no difference of two instants on one clock.
TEST(PositionSets, OfOneHostWithATimeBaseAreOnItsOwnClock) {
  constexpr std::int64_t kBehind = 5'000 * kMs;
  TimeBase time;
  time.OnTime(Time(kClock, 5 * kMs - kBehind + 6'000 * kMs, kBehind - 6'000 * kMs), 0);
  PositionSetBuilder::Options options = TwoAxes();
  options.time = &time;
  PositionSetBuilder sets(options);
  for (const std::size_t axis : {std::size_t{0}, std::size_t{1}}) {
    position_t message = Reading(5, 15);
    message.mono_ns += 6'000 * kMs - kBehind;
    sets.OnPosition(axis, message, 0);
  }
  const Set* set = sets.Next(0);
  ASSERT_NE(set, nullptr);
  EXPECT_EQ(set->base_id, 0);
  EXPECT_EQ(set->latest_ns - set->earliest_ns, 20 * kUs);
  EXPECT_NEAR(set->axes[0].offset_ns, 15 * kUs, 5) << "from the tick of the base";
}

}  // namespace
}  // namespace axlecast
