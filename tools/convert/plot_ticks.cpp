#include "tools/convert/plot_ticks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>

namespace axlecast {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kDayUs = 86'400 * kSecondUs;

// 1, 2 or 5 times a power of ten, not below `least`.
double RoundStep(double minimum) {
  const double power = std::pow(10.0, std::floor(std::log10(minimum)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= minimum * (1 - 1e-9)) return step * power;
  }
  return 10 * power;
}

std::string NumberLabel(double value, double step) {
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  const bool plain = decimals <= 9 && std::abs(value) < 1e12;
  std::array<char, 48> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), plain ? "%.*f" : "%.*g", plain ? decimals : 7, value));
  return text.data();
}

// us between ticks, not below `least`.
std::int64_t TimeStep(double minimum) {
  if (minimum <= static_cast<double>(kSecondUs)) {
    return std::max<std::int64_t>(1, std::llround(RoundStep(std::max(minimum, 1.0))));
  }
  for (const std::int64_t seconds :
       {1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1'800, 3'600, 7'200, 10'800, 21'600, 43'200}) {
    if (static_cast<double>(seconds * kSecondUs) >= minimum) return seconds * kSecondUs;
  }
  return std::max<std::int64_t>(1, std::llround(RoundStep(minimum / static_cast<double>(kDayUs)))) * kDayUs;
}

std::string UtcLabel(std::int64_t us, const char* format) {
  const std::time_t seconds = us / kSecondUs;
  std::tm parts{};
  std::array<char, 40> text{};
  if (gmtime_r(&seconds, &parts) == nullptr || std::strftime(text.data(), text.size(), format, &parts) == 0)
    return "?";
  return text.data();
}

// With as many decimals of a second as the step needs.
std::string TimeLabel(std::int64_t us, std::int64_t step) {
  if (step >= kDayUs) return UtcLabel(us, "%Y-%m-%d");
  if (step % (60 * kSecondUs) == 0) return UtcLabel(us, "%H:%M");
  std::string label = UtcLabel(us, "%H:%M:%S");
  if (step % kSecondUs == 0) return label;
  std::array<char, 16> fraction{};
  static_cast<void>(std::snprintf(fraction.data(), fraction.size(), ".%06d", static_cast<int>(us % kSecondUs)));
  label += fraction.data();
  for (std::int64_t unit = 10; step % unit == 0; unit *= 10) label.pop_back();
  return label;
}

}  // namespace

RoundAxis MakeRoundAxis(double low, double high, int wanted) {
  const double size = std::max(std::abs(low), std::abs(high));
  // What differs only in a double's last digits is one number.
  if (high - low <= size * 1e-12) {
    const double margin = std::max(size * 0.05, 0.5);
    low -= margin;
    high += margin;
  }
  RoundAxis axis;
  const double step = RoundStep((high - low) / wanted);
  const double first = std::floor(low / step + 1e-9);
  const double last = std::ceil(high / step - 1e-9);
  for (double i = first; i <= last; ++i) axis.ticks.push_back({i * step, NumberLabel(i * step + 0.0, step)});
  axis.low = first * step;
  axis.high = last * step;
  return axis;
}

TimeAxis MakeTimeAxis(std::int64_t first_us, std::int64_t last_us, int wanted) {
  TimeAxis axis;
  const std::int64_t step = TimeStep(static_cast<double>(last_us - first_us) / wanted);
  for (std::int64_t us = (first_us + step - 1) / step * step; us <= last_us; us += step) {
    axis.ticks.push_back({static_cast<double>(us), TimeLabel(us, step)});
  }
  const std::string first_day = UtcLabel(first_us, "%Y-%m-%d");
  const std::string last_day = UtcLabel(last_us, "%Y-%m-%d");
  axis.title = "UTC, " + first_day + (first_day == last_day ? "" : " to " + last_day);
  return axis;
}

}  // namespace axlecast
