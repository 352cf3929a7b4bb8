#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace axlecast {

// What a plot is drawn on; px, from the upper left corner.
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
  enum class Stroke : std::uint8_t { kAxis, kGrid };
  enum class Anchor : std::uint8_t { kStart, kMiddle, kEnd };
  struct Style {
    Anchor anchor = Anchor::kStart;
    bool bold = false;
  };

  Canvas() = default;
  virtual ~Canvas() = default;
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  virtual void Line(Point from, Point to, Stroke stroke) = 0;
  // Of the curve with this number, in its colour: through all points; a single point is a dot.
  virtual void Curve(const std::vector<Point>& points, std::size_t number) = 0;
  // On the baseline at this point.
  virtual void Text(Point at, std::string_view text, Style style) = 0;
};

struct CurveColour {
  const char* on_light;  // "#rrggbb"
  const char* on_dark;
};

// Of the curve with this number; they repeat after the last. Distinct also for the colour-blind (Okabe and Ito).
inline constexpr CurveColour kCurveColours[] = {{"#0072b2", "#56b4e9"}, {"#d55e00", "#ff8c42"},
                                                {"#009e73", "#2fd6a7"}, {"#cc79a7", "#e8a5c8"},
                                                {"#8a6d00", "#f0e442"}, {"#6a3d9a", "#c9a6ff"}};

}  // namespace axlecast
