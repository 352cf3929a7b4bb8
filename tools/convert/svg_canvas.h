#pragma once

#include <string>

#include "tools/convert/canvas.h"

namespace axlecast {

// An SVG picture, readable on light and dark ground; its text stays text.
class SvgCanvas : public Canvas {
 public:
  SvgCanvas(Size size, std::string_view title);

  void Line(Point from, Point to, Stroke stroke) override;
  void Curve(const std::vector<Point>& points, std::size_t number) override;
  void Text(Point at, std::string_view text, Style style) override;

  [[nodiscard]] std::string Svg() const { return text_ + "</svg>\n"; }

 private:
  std::string text_;
};

}  // namespace axlecast
