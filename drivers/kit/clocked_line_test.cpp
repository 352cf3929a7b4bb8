#include <gtest/gtest.h>
#include <array>

#include "drivers/kit/clocked_line.h"

namespace axlecast {
namespace {

constexpr std::array<std::uint8_t, 9> kBytes = {0x8A, 0xE3, 0x8A, 0x00, 0xFF, 0x5A, 0x81, 0x7E, 0xC1};
static_assert(BitsAt(kBytes, 0, 16) == 0x8AE3);
static_assert(BitsAt(kBytes, 4, 8) == 0xAE);
static_assert(BitsAt(kBytes, 71, 1) == 1);
static_assert(BitsAt(kBytes, 72, 0) == 0);

TEST(Bits, ManyAreAsEachAlone) {
  for (std::size_t first = 0; first <= 72; ++first) {
    for (std::size_t count = 0; count <= 64 && first + count <= 72; ++count) {
      std::uint64_t expected = 0;
      for (std::size_t i = 0; i < count; ++i) expected = expected * 2 + (BitAt(kBytes, first + i) ? 1 : 0);
      EXPECT_EQ(BitsAt(kBytes, first, count), expected) << first << ' ' << count;
    }
  }
}

// TWK SSI 11.3: "For a cable of length 200 m the total delay is 300 ns + 2 x 6.5 ns/m x 200 m = 2900 ns"; "the clock
// frequency selected is 300 kHz, namely the maximum permitted for a cable length of 200 m. This clock frequency is
// equivalent to a clock cycle time of 3.3 us".
TEST(ClockPlan, TheDocumentsExampleOf200Metres) {
  const ClockPlan plan = PlanClock({.cable_m = 200});
  EXPECT_DOUBLE_EQ(plan.delay_ns, 2900);
  EXPECT_DOUBLE_EQ(plan.highest_hz, 300e3);
  EXPECT_NEAR(1e6 / plan.highest_hz, 3.3, 0.05);
  // SPI samples half a cycle after the edge, and cannot go as far: 1 / (2 x 2900 ns).
  EXPECT_NEAR(plan.highest_half_cycle_hz, 172'413.8, 0.1);
}

// TWK SSI 11.4: t_TD < t_EV < t_TD + t_T, best t_TD + t_T / 2.
TEST(ClockPlan, WhenToReadInThatExample) {
  const ClockPlan plan = PlanClock({.cable_m = 200});
  const EvaluationDelay delay = PlanEvaluation(plan, 300e3);
  EXPECT_DOUBLE_EQ(delay.least_ns, 2900);
  EXPECT_NEAR(delay.most_ns, 2900 + 3333.3, 0.1);
  EXPECT_NEAR(delay.best_ns, 2900 + 1666.7, 0.1);
}

// TWK SSI 10: t_M = 10 us to 30 us: f = 1 / 10 us = 100 kHz; in the standard version 15 us <= t_M <= 25 us.
TEST(ClockPlan, TheMonoflopSetsTheLowestClock) {
  EXPECT_DOUBLE_EQ(PlanClock({.monoflop = 10 * kMicrosecond}).lowest_hz, 100e3);
  EXPECT_NEAR(PlanClock({.monoflop = 15 * kMicrosecond}).lowest_hz, 66'666.7, 0.1);
  EXPECT_EQ(PlanClock({}).lowest_hz, 0);
  EXPECT_DOUBLE_EQ(PlanClock({.monoflop = 15 * kMicrosecond, .least_hz = 100e3}).lowest_hz, 100e3);
}

TEST(ClockPlan, TheEncodersLimitAndTheStandards) {
  EXPECT_DOUBLE_EQ(PlanClock({.most_hz = 250e3}).highest_half_cycle_hz, 250e3);
  EXPECT_DOUBLE_EQ(PlanClock({}).highest_hz, 5e6);  // half of 10 Mbit/s
  EXPECT_DOUBLE_EQ(PlanClock({.cable_m = 12}).highest_hz, 5e6);
  EXPECT_DOUBLE_EQ(PlanClock({.cable_m = 1200}).highest_hz, 50e3);  // half of 100 kbit/s
  EXPECT_NEAR(PlanClock({}).highest_half_cycle_hz, 1e9 / 600, 1);   // 300 ns of delay without any cable
  EXPECT_DOUBLE_EQ(PlanClock({.encoder_delay_ns = 0, .receiver_delay_ns = 0}).highest_half_cycle_hz, 5e6);
}

// Whatever the line: the clock that is proposed is allowed; and it leaves room for a controller that halves.
TEST(ClockPlan, TheGoodClockLiesBetweenTheLimits) {
  int proposed = 0;
  for (double cable_m = 0; cable_m <= 1500; cable_m += 7) {
    for (const MonoNs monoflop_us : {0, 1, 10, 15, 30, 500}) {
      const ClockPlan plan =
          PlanClock({.cable_m = cable_m, .monoflop = monoflop_us * kMicrosecond, .most_hz = 1e6});
      if (plan.half_cycle_hz == 0) {
        EXPECT_GT(plan.lowest_hz + 2, plan.highest_half_cycle_hz) << cable_m << ' ' << monoflop_us;
        continue;
      }
      ++proposed;
      const auto clock = static_cast<double>(plan.half_cycle_hz);
      EXPECT_GT(clock, plan.lowest_hz);
      EXPECT_LT(clock, plan.highest_half_cycle_hz);
      if (plan.highest_half_cycle_hz > 2.5 * plan.lowest_hz) {
        EXPECT_GT(clock / 2, plan.lowest_hz);
      }
    }
  }
  EXPECT_GT(proposed, 700);
}

TEST(ClockPlan, ACableThatNoClockFits) {
  const ClockPlan plan = PlanClock({.cable_m = 1000, .monoflop = 10 * kMicrosecond});
  EXPECT_GT(plan.lowest_hz, plan.highest_half_cycle_hz);
  EXPECT_EQ(plan.half_cycle_hz, 0);
}

}  // namespace
}  // namespace axlecast
