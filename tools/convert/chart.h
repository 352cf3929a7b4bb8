#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/convert/canvas.h"

namespace axlecast {

// A labelled position on an axis.
struct Tick {
  double at = 0;
  std::string label;
};

// An axis that begins and ends at round numbers around its values. Ticks are at multiples of 1, 2 or 5 times a power of
// ten. Without values, it has no ticks.
struct RoundAxis {
  double low = 0;
  double high = 1;
  std::vector<Tick> ticks;
};

// Returns an axis around the finite values [low, high], with about `tick_count` ticks. If low equals high, the axis has a
// margin on both sides. If low is above high, there are no values.
[[nodiscard]] RoundAxis MakeRoundAxis(double low, double high, int tick_count);

struct TimeAxis {
  std::vector<Tick> ticks;  // `at` in us
  std::string title;        // what the labels omit: the time scale and the date
};

// Returns ticks at round times of day (1, 2, 5, 15, 30 s, ...) within [first_us, last_us], at most about `tick_count`.
[[nodiscard]] TimeAxis MakeTimeAxis(std::int64_t first_us, std::int64_t last_us, int tick_count);

// The area of a chart in which curves are drawn: its place in px, and the scales of both axes.
struct ChartPanel {
  double left = 0;
  double right = 0;
  double top = 0;
  double bottom = 0;
  double first_x = 0;  // value at the left edge
  double last_x = 0;   // value at the right edge, not equal to first_x
  RoundAxis values;

  [[nodiscard]] Canvas::Point At(double x, double value) const;
};

// Draws both axes of the panel, a grid line for each tick of its values, the ticks of x, and a title below.
void DrawAxes(Canvas& canvas, const ChartPanel& panel, const std::vector<Tick>& x_ticks,
              const std::string& x_title);

}  // namespace axlecast
