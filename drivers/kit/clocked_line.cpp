#include "drivers/kit/clocked_line.h"

#include <algorithm>
#include <cmath>

namespace axlecast {
namespace {

constexpr double kNsPerSecond = 1e9;
// TWK SSI 11.1: the clock is at most half of the baud rate that RS-422 allows. The document's graph is lost; the
// standard's guideline is 10 Mbit/s up to 12 m and a constant product of rate and length beyond, and gives the
// document's own example, 300 kHz at 200 m.
constexpr double kMaxHz = 5e6;
constexpr double kMaxHzMetres = 60e6;
// A controller may take a clock that is lower than what it is asked for; many only halve. Twice the lowest and a
// tenth keeps even those above it.
constexpr double kAboveLowest = 2.2;
constexpr double kBelowHighest = 0.9;
constexpr double kRound = 100;

double AtMost(double limit, double other) { return other > 0 ? std::min(limit, other) : limit; }

std::int64_t GoodClock(double lowest, double highest) {
  double clock = kBelowHighest * highest;
  if (lowest > 0) clock = std::min(clock, kAboveLowest * lowest);
  clock = std::floor(clock / kRound) * kRound;
  if (clock <= lowest) clock = std::floor((lowest + highest) / 2);
  return clock > lowest && clock < highest ? static_cast<std::int64_t>(clock) : 0;
}

}  // namespace

ClockPlan PlanClock(const ClockedLine& line) {
  ClockPlan plan;
  // 11.3: t_TD = t_C + 2 x t_CA + t_E; the cable counts twice, for the clock and for the data.
  plan.delay_ns = line.encoder_delay_ns + 2 * line.cable_ns_per_m * line.cable_m + line.receiver_delay_ns;
  plan.lowest_hz = line.least_hz;
  if (line.monoflop > 0) {
    plan.lowest_hz = std::max(plan.lowest_hz, kNsPerSecond / static_cast<double>(line.monoflop));
  }
  plan.highest_hz = AtMost(kMaxHz, line.most_hz);
  if (line.cable_m > 0) plan.highest_hz = std::min(plan.highest_hz, kMaxHzMetres / line.cable_m);
  plan.highest_half_cycle_hz = plan.highest_hz;
  if (plan.delay_ns > 0) {
    plan.highest_half_cycle_hz = std::min(plan.highest_hz, kNsPerSecond / (2 * plan.delay_ns));
  }
  plan.half_cycle_hz = GoodClock(plan.lowest_hz, plan.highest_half_cycle_hz);
  return plan;
}

EvaluationDelay PlanEvaluation(const ClockPlan& plan, double clock_hz) {
  const double cycle_ns = kNsPerSecond / clock_hz;
  return {plan.delay_ns, plan.delay_ns + cycle_ns / 2, plan.delay_ns + cycle_ns};
}

}  // namespace axlecast
