#include "tools/convert/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>

namespace axlecast {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kDayUs = 86'400 * kSecondUs;

// Returns 1, 2 or 5 times a power of ten, at least `minimum`.
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

// Returns the time between ticks in us, at least `minimum`.
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

// Returns the time with as many decimals of a second as the step needs.
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

RoundAxis MakeRoundAxis(double low, double high, int tick_count) {
  if (low > high) return {};
  const double size = std::max(std::abs(low), std::abs(high));
  // Values that differ only in the last digits of a double count as equal.
  if (high - low <= size * 1e-12) {
    const double margin = std::max(size * 0.05, 0.5);
    low -= margin;
    high += margin;
  }
  RoundAxis axis;
  const double step = RoundStep((high - low) / tick_count);
  const double first = std::floor(low / step + 1e-9);
  const double last = std::ceil(high / step - 1e-9);
  for (double i = first; i <= last; ++i) axis.ticks.push_back({i * step, NumberLabel(i * step + 0.0, step)});
  axis.low = first * step;
  axis.high = last * step;
  return axis;
}

TimeAxis MakeTimeAxis(std::int64_t first_us, std::int64_t last_us, int tick_count) {
  TimeAxis axis;
  const std::int64_t step = TimeStep(static_cast<double>(last_us - first_us) / tick_count);
  for (std::int64_t us = (first_us + step - 1) / step * step; us <= last_us; us += step) {
    axis.ticks.push_back({static_cast<double>(us), TimeLabel(us, step)});
  }
  const std::string first_day = UtcLabel(first_us, "%Y-%m-%d");
  const std::string last_day = UtcLabel(last_us, "%Y-%m-%d");
  axis.title = "UTC, " + first_day + (first_day == last_day ? "" : " to " + last_day);
  return axis;
}

Canvas::Point ChartPanel::At(double x, double value) const {
  return {left + (x - first_x) / (last_x - first_x) * (right - left),
          top + (bottom - top) * (values.high - value) / (values.high - values.low)};
}

void DrawAxes(Canvas& canvas, const ChartPanel& panel, const std::vector<Tick>& x_ticks,
              const std::string& x_title) {
  for (const Tick& tick : panel.values.ticks) {
    const double y = panel.At(panel.first_x, tick.at).y;
    canvas.DrawLine({panel.left, y}, {panel.right, y}, Canvas::Stroke::kGrid);
    canvas.DrawText({panel.left - 7, y + 4}, tick.label, {.anchor = Canvas::Anchor::kEnd});
  }
  canvas.DrawLine({panel.left, panel.top}, {panel.left, panel.bottom}, Canvas::Stroke::kAxis);
  for (const Tick& tick : x_ticks) {
    const double x = panel.At(tick.at, 0).x;
    canvas.DrawLine({x, panel.bottom}, {x, panel.bottom + 4}, Canvas::Stroke::kAxis);
    canvas.DrawText({x, panel.bottom + 17}, tick.label, {.anchor = Canvas::Anchor::kMiddle});
  }
  canvas.DrawLine({panel.left, panel.bottom}, {panel.right, panel.bottom}, Canvas::Stroke::kAxis);
  canvas.DrawText({(panel.left + panel.right) / 2, panel.bottom + 33}, x_title,
                  {.anchor = Canvas::Anchor::kMiddle});
}

}  // namespace axlecast
