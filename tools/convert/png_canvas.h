#pragma once

#include <memory>
#include <string>

#include "tools/convert/canvas.h"

namespace axlecast {

// A PNG picture on white ground, drawn by Cairo.
class PngCanvas : public Canvas {
 public:
  explicit PngCanvas(Size size);
  ~PngCanvas() override;

  void Line(Point from, Point to, Stroke stroke) override;
  void Curve(const std::vector<Point>& points, std::size_t number) override;
  void Text(Point at, std::string_view text, Style style) override;

  // The file's bytes; empty when Cairo could not make it (memory).
  [[nodiscard]] std::string Png() const;

 private:
  struct Drawing;
  std::unique_ptr<Drawing> drawing_;
};

}  // namespace axlecast
