#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace axlecast {

// A picture that is being drawn: coordinates in px, from the upper left corner. Used for plots of logs and of trips.
class Canvas {
 public:
  struct Point {
    double x = 0;
    double y = 0;
  };
  struct Size {
    double width = 0;
    double height = 0;
  };
  enum class Stroke : std::uint8_t { kAxis, kGrid, kDashed };
  enum class Anchor : std::uint8_t { kStart, kMiddle, kEnd };
  struct TextStyle {
    Anchor anchor = Anchor::kStart;
    bool bold = false;
  };
  struct CurveStyle {
    std::size_t number = 0;  // selects the colour; colours repeat after the sixth
    bool dashed = false;     // also give curves after the first a dash pattern, for print without colours
  };
  using Polyline = std::vector<Point>;

  Canvas() = default;
  virtual ~Canvas() = default;
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  virtual void DrawLine(Point from, Point to, Stroke stroke) = 0;
  // Draws the polylines of one curve. A polyline of a single point is drawn as a dot.
  virtual void DrawCurve(const std::vector<Polyline>& polylines, CurveStyle style) = 0;
  // Draws the sample line of a curve in a legend.
  virtual void DrawLegendLine(Point from, Point to, CurveStyle style) = 0;
  virtual void DrawCircle(Point centre, CurveStyle style) = 0;
  // Draws text with its baseline at `at`. Bytes that are not UTF-8 and control characters are replaced.
  virtual void DrawText(Point at, std::string_view text, TextStyle style) = 0;

  // Returns the bytes of the file. The only error is a lack of memory.
  [[nodiscard]] virtual Result<std::string> Finish() = 0;
};

// Makes an SVG picture for light and dark backgrounds. Its text stays text that can be searched and copied.
[[nodiscard]] std::unique_ptr<Canvas> MakeSvgCanvas(Canvas::Size size, std::string_view title);

// Makes a PNG picture on a white background.
[[nodiscard]] std::unique_ptr<Canvas> MakePngCanvas(Canvas::Size size);

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
