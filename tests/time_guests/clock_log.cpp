#include "tests/time_guests/clock_log.h"

#include <algorithm>
#include <cmath>

namespace axlecast {
namespace {

std::int64_t ValueOf(const ClockReading& reading, ClockLog::Clock clock) {
  switch (clock) {
    case ClockLog::Clock::kMono:
      return reading.mono;
    case ClockLog::Clock::kRaw:
      return reading.raw;
    case ClockLog::Clock::kUtc:
      return reading.utc;
  }
  return 0;
}

// ns per tick.
struct Rates {
  double lowest = 0;
  double highest = 0;
};

constexpr std::int64_t kResolution = 1;  // a clock shows whole ns

// The mean rate between the readings i and i + 1.
Rates MeanRate(const std::vector<ClockReading>& readings, ClockLog::Clock clock, std::size_t i) {
  const std::int64_t rise = ValueOf(readings[i + 1], clock) - ValueOf(readings[i], clock);
  return {
      static_cast<double>(rise - kResolution) / static_cast<double>(readings[i + 1].after - readings[i].before),
      static_cast<double>(rise + kResolution) / static_cast<double>(readings[i + 1].before - readings[i].after)};
}

// The rates that are possible between the readings i and i + 1.
Rates RatesAround(const std::vector<ClockReading>& readings, ClockLog::Clock clock, std::size_t i) {
  Rates rates = MeanRate(readings, clock, i);
  const auto include = [&](const Rates& other) {
    rates.lowest = std::min(rates.lowest, other.lowest);
    rates.highest = std::max(rates.highest, other.highest);
  };
  if (i > 0) include(MeanRate(readings, clock, i - 1));
  if (i + 2 < readings.size()) include(MeanRate(readings, clock, i + 1));
  return rates;
}

std::int64_t Down(double value) { return static_cast<std::int64_t>(std::floor(value)); }
std::int64_t Up(double value) { return static_cast<std::int64_t>(std::ceil(value)); }
std::int64_t Least(std::int64_t distance, const Rates& rates) {
  return Down(static_cast<double>(distance) * (distance < 0 ? rates.highest : rates.lowest));
}
std::int64_t Most(std::int64_t distance, const Rates& rates) {
  return Up(static_cast<double>(distance) * (distance < 0 ? rates.lowest : rates.highest));
}

std::optional<Bounds> Common(const Bounds& a, const Bounds& b) {
  const Bounds both = {std::max(a.lowest, b.lowest), std::min(a.highest, b.highest)};
  if (both.lowest > both.highest) return std::nullopt;
  return both;
}

std::optional<Bounds> ValueAt(const std::vector<ClockReading>& readings, ClockLog::Clock clock, CpuTicks ticks,
                              std::size_t i) {
  const Rates rates = RatesAround(readings, clock, i);
  const ClockReading& a = readings[i];
  const ClockReading& b = readings[i + 1];
  const std::int64_t first = ValueOf(a, clock);
  const std::int64_t second = ValueOf(b, clock);
  return Common({first + Least(ticks - a.after, rates), first + Most(ticks - a.before, rates) + kResolution},
                {second - Most(b.after - ticks, rates), second - Least(b.before - ticks, rates) + kResolution});
}

}  // namespace

void ClockLog::Add(const ClockReading& reading) {
  if (!readings_.empty() && reading.before <= readings_.back().after) return;
  readings_.push_back(reading);
}

std::size_t ClockLog::IndexAt(CpuTicks ticks) const {
  const auto found = std::lower_bound(readings_.begin(), readings_.end(), ticks,
                                      [](const ClockReading& reading, CpuTicks t) { return reading.after < t; });
  return static_cast<std::size_t>(found - readings_.begin());
}

std::optional<Bounds> ClockLog::At(Clock clock, const Bounds& ticks) const {
  const auto at = [&](CpuTicks instant) -> std::optional<Bounds> {
    const std::size_t next = IndexAt(instant);
    if (next == 0 || next == readings_.size()) return std::nullopt;
    return ValueAt(readings_, clock, instant, next - 1);
  };
  const std::optional<Bounds> earliest = at(ticks.lowest);
  const std::optional<Bounds> latest = at(ticks.highest);
  if (!earliest || !latest) return std::nullopt;
  return Bounds{earliest->lowest, latest->highest};
}

std::optional<Bounds> ClockLog::When(Clock clock, std::int64_t ns) const {
  const auto found =
      std::lower_bound(readings_.begin(), readings_.end(), ns,
                       [&](const ClockReading& reading, std::int64_t n) { return ValueOf(reading, clock) < n; });
  if (found == readings_.begin() || found == readings_.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(found - readings_.begin()) - 1;
  const Rates rates = RatesAround(readings_, clock, i);
  const Rates ticks_per_ns = {1 / rates.highest, 1 / rates.lowest};
  const ClockReading& a = readings_[i];
  const ClockReading& b = readings_[i + 1];
  const std::int64_t since = ns - ValueOf(a, clock);
  const std::int64_t left = ValueOf(b, clock) - ns;
  return Common(
      {a.before + Least(since - kResolution, ticks_per_ns), a.after + Most(since + kResolution, ticks_per_ns)},
      {b.before - Most(left + kResolution, ticks_per_ns), b.after - Least(left - kResolution, ticks_per_ns)});
}

std::int64_t ClockLog::LongestGap(CpuTicks from, CpuTicks until) const {
  std::int64_t longest = 0;
  for (std::size_t i = std::max<std::size_t>(IndexAt(from), 1); i < readings_.size(); ++i) {
    longest = std::max(longest, readings_[i].raw - readings_[i - 1].raw);
    if (readings_[i].before > until) break;
  }
  return longest;
}

}  // namespace axlecast
