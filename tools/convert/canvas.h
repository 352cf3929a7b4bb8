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

}  // namespace axlecast
