#include "tools/convert/png_canvas.h"

#include <cairo.h>

#include <cmath>
#include <iterator>

#include "core/base/safe_text.h"

namespace axlecast {
namespace {

void SetColour(cairo_t* cairo, std::string_view hex) {
  const auto part = [&](std::size_t at) { return std::stoi(std::string(hex.substr(at, 2)), nullptr, 16) / 255.0; };
  cairo_set_source_rgb(cairo, part(1), part(3), part(5));
}

cairo_status_t Append(void* text, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

struct PngCanvas::Drawing {
  explicit Drawing(Size size)
      : surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::ceil(size.width)),
                                           static_cast<int>(std::ceil(size.height)))),
        cairo(cairo_create(surface)) {}
  ~Drawing() {
    cairo_destroy(cairo);
    cairo_surface_destroy(surface);
  }
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;

  cairo_surface_t* surface;
  cairo_t* cairo;
};

PngCanvas::PngCanvas(Size size) : drawing_(std::make_unique<Drawing>(size)) {
  cairo_t* const cairo = drawing_->cairo;
  SetColour(cairo, "#ffffff");
  cairo_paint(cairo);
  cairo_set_font_size(cairo, 12);
  cairo_set_line_cap(cairo, CAIRO_LINE_CAP_ROUND);
  cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
}

PngCanvas::~PngCanvas() = default;

void PngCanvas::Line(Point from, Point to, Stroke stroke) {
  cairo_t* const cairo = drawing_->cairo;
  SetColour(cairo, stroke == Stroke::kAxis ? "#888888" : "#e4e4e4");
  cairo_set_line_width(cairo, 1);
  cairo_move_to(cairo, from.x, from.y);
  cairo_line_to(cairo, to.x, to.y);
  cairo_stroke(cairo);
}

void PngCanvas::Curve(const std::vector<Point>& points, std::size_t number) {
  if (points.empty()) return;
  cairo_t* const cairo = drawing_->cairo;
  SetColour(cairo, kCurveColours[number % std::size(kCurveColours)].on_light);
  cairo_set_line_width(cairo, 1.5);
  cairo_move_to(cairo, points.front().x, points.front().y);
  for (const Point& point : points) cairo_line_to(cairo, point.x, point.y);
  cairo_stroke(cairo);
}

void PngCanvas::Text(Point at, std::string_view text, Style style) {
  cairo_t* const cairo = drawing_->cairo;
  std::string shown = MendedUtf8(text);
  for (char& c : shown) {
    if (c >= 0 && c < ' ') c = '?';
  }
  SetColour(cairo, "#222222");
  cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_text_extents_t extents{};
  cairo_text_extents(cairo, shown.c_str(), &extents);
  const double before = style.anchor == Anchor::kStart ? 0 : style.anchor == Anchor::kMiddle ? 0.5 : 1;
  cairo_move_to(cairo, at.x - before * extents.x_advance, at.y);
  cairo_show_text(cairo, shown.c_str());
}

std::string PngCanvas::Png() const {
  std::string png;
  if (cairo_surface_write_to_png_stream(drawing_->surface, Append, &png) != CAIRO_STATUS_SUCCESS) return "";
  return png;
}

}  // namespace axlecast
