#include "tools/convert/canvas.h"

#include <cairo.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "core/base/text.h"

namespace axlecast {
namespace {

struct CurveColour {
  const char* on_light;  // "#rrggbb"
  const char* on_dark;
};

// Can be distinguished by the colour-blind too (Okabe and Ito).
constexpr CurveColour kCurveColours[] = {{"#0072b2", "#56b4e9"}, {"#d55e00", "#ff8c42"}, {"#009e73", "#2fd6a7"},
                                         {"#cc79a7", "#e8a5c8"}, {"#8a6d00", "#f0e442"}, {"#6a3d9a", "#c9a6ff"}};
constexpr const char* kAxisColour = "#888888";
constexpr const char* kGridColour = "#e4e4e4";
constexpr const char* kTextColour = "#222222";
constexpr double kCurveWidth = 1.5;
constexpr double kCircleRadius = 4;
constexpr double kCircleWidth = 2;
constexpr double kFontSize = 12;

std::size_t ColourIndex(Canvas::CurveStyle style) { return style.number % std::size(kCurveColours); }

// Returns the lengths of dash and gap; nothing for a solid line.
std::vector<double> DashPattern(Canvas::CurveStyle style) {
  if (!style.dashed || style.number == 0) return {};
  return style.number % 2 == 1 ? std::vector<double>{6, 2} : std::vector<double>{2, 2};
}

std::vector<double> DashPattern(Canvas::Stroke stroke) {
  return stroke == Canvas::Stroke::kDashed ? std::vector<double>{4, 3} : std::vector<double>{};
}

std::string Px(double value) {
  std::array<char, 40> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%.1f", value));
  return text.data();
}

// Cairo's SVG surface is not used: it draws text as glyphs and cannot follow the viewer's dark mode.
class SvgCanvas : public Canvas {
 public:
  SvgCanvas(Size size, std::string_view title) {
    const std::string width = Px(size.width);
    const std::string height = Px(size.height);
    svg_ = "<svg xmlns=\"http://www.w3.org/2000/svg\"" + Attribute("width", width) + Attribute("height", height) +
           Attribute("viewBox", "0 0 " + width + ' ' + height) +
           " role=\"img\" font-family=\"sans-serif\" font-size=\"12\"" + Attribute("fill", kTextColour) +
           ">\n<title>" + EscapedMarkup(title) + "</title>\n" + DarkStyle() +
           "<rect width=\"100%\" height=\"100%\" class=\"ground\" fill=\"#fff\"/>\n";
  }

  void DrawLine(Point from, Point to, Stroke stroke) override {
    AddLine(from, to,
            (stroke == Stroke::kGrid ? " class=\"grid\"" + Attribute("stroke", kGridColour)
                                     : Attribute("stroke", kAxisColour)) +
                Dashes(DashPattern(stroke)));
  }

  void DrawCurve(const std::vector<Polyline>& polylines, CurveStyle style) override {
    std::string path;
    for (const Polyline& points : polylines) {
      char command = 'M';
      for (const Point& point : points) {
        path += command + Px(point.x) + ' ' + Px(point.y);
        command = 'L';
      }
      if (points.size() == 1) path += 'L' + Px(points[0].x) + ' ' + Px(points[0].y);
    }
    if (path.empty()) return;
    svg_ += "<path" + Attribute("d", path) + CurveAttributes(style, kCurveWidth) +
            " stroke-linecap=\"round\" stroke-linejoin=\"round\"/>\n";
  }

  void DrawLegendLine(Point from, Point to, CurveStyle style) override {
    AddLine(from, to, CurveAttributes(style, kCurveWidth));
  }

  void DrawCircle(Point centre, CurveStyle style) override {
    svg_ += "<circle" + Attribute("cx", Px(centre.x)) + Attribute("cy", Px(centre.y)) +
            Attribute("r", Px(kCircleRadius)) + CurveAttributes({.number = style.number}, kCircleWidth) + "/>\n";
  }

  void DrawText(Point at, std::string_view text, TextStyle style) override {
    svg_ += "<text" + Attribute("x", Px(at.x)) + Attribute("y", Px(at.y)) +
            (style.anchor == Anchor::kMiddle ? " text-anchor=\"middle\""
             : style.anchor == Anchor::kEnd  ? " text-anchor=\"end\""
                                             : "") +
            (style.bold ? " font-weight=\"bold\">" : ">") + EscapedMarkup(text) + "</text>\n";
  }

  [[nodiscard]] Result<std::string> Finish() override { return svg_ + "</svg>\n"; }

 private:
  static std::string Attribute(const char* name, const std::string& value) {
    return std::string(" ") + name + "=\"" + value + '"';
  }
  static std::string Dashes(const std::vector<double>& pattern) {
    return pattern.empty() ? "" : Attribute("stroke-dasharray", Px(pattern[0]) + ' ' + Px(pattern[1]));
  }
  // A class for the dark style, and attributes for viewers without style sheets.
  static std::string CurveAttributes(CurveStyle style, double width) {
    const std::size_t colour = ColourIndex(style);
    return Attribute("class", "c" + std::to_string(colour)) + Attribute("stroke", kCurveColours[colour].on_light) +
           " fill=\"none\"" + Attribute("stroke-width", Px(width)) + Dashes(DashPattern(style));
  }
  static std::string DarkStyle() {
    std::string style =
        "<style>@media(prefers-color-scheme:dark){text{fill:#ddd}.ground{fill:#1c1c1c}.grid{stroke:#3a3a3a}";
    for (std::size_t i = 0; i < std::size(kCurveColours); ++i) {
      style += ".c" + std::to_string(i) + "{stroke:" + kCurveColours[i].on_dark + '}';
    }
    return style + "}</style>\n";
  }
  void AddLine(Point from, Point to, const std::string& attributes) {
    svg_ += "<line" + Attribute("x1", Px(from.x)) + Attribute("y1", Px(from.y)) + Attribute("x2", Px(to.x)) +
            Attribute("y2", Px(to.y)) + attributes + "/>\n";
  }

  std::string svg_;
};

class PngCanvas : public Canvas {
 public:
  explicit PngCanvas(Size size)
      : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::ceil(size.width)),
                                            static_cast<int>(std::ceil(size.height)))),
        cairo_(cairo_create(surface_)) {
    SetColour("#ffffff");
    cairo_paint(cairo_);
    cairo_set_font_size(cairo_, kFontSize);
    cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
  }
  ~PngCanvas() override {
    cairo_destroy(cairo_);
    cairo_surface_destroy(surface_);
  }
  PngCanvas(const PngCanvas&) = delete;
  PngCanvas& operator=(const PngCanvas&) = delete;

  void DrawLine(Point from, Point to, Stroke stroke) override {
    StrokeLines({{from, to}}, stroke == Stroke::kGrid ? kGridColour : kAxisColour, 1, DashPattern(stroke));
  }

  void DrawCurve(const std::vector<Polyline>& polylines, CurveStyle style) override {
    StrokeLines(polylines, kCurveColours[ColourIndex(style)].on_light, kCurveWidth, DashPattern(style));
  }

  void DrawLegendLine(Point from, Point to, CurveStyle style) override { DrawCurve({{from, to}}, style); }

  void DrawCircle(Point centre, CurveStyle style) override {
    constexpr double kFullTurn = 2 * M_PI;
    cairo_new_path(cairo_);
    cairo_arc(cairo_, centre.x, centre.y, kCircleRadius, 0, kFullTurn);
    StrokePath(kCurveColours[ColourIndex(style)].on_light, kCircleWidth, {});
  }

  void DrawText(Point at, std::string_view text, TextStyle style) override {
    std::string shown = MendedUtf8(text);
    for (char& c : shown) {
      if (c >= 0 && c < ' ') c = '?';
    }
    SetColour(kTextColour);
    cairo_select_font_face(cairo_, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_text_extents_t extents{};
    cairo_text_extents(cairo_, shown.c_str(), &extents);
    const double before = style.anchor == Anchor::kStart ? 0 : style.anchor == Anchor::kMiddle ? 0.5 : 1;
    cairo_move_to(cairo_, at.x - before * extents.x_advance, at.y);
    cairo_show_text(cairo_, shown.c_str());
  }

  [[nodiscard]] Result<std::string> Finish() override {
    const auto append = [](void* png, const unsigned char* data, unsigned int length) {
      static_cast<std::string*>(png)->append(reinterpret_cast<const char*>(data), length);
      return CAIRO_STATUS_SUCCESS;
    };
    std::string png;
    if (cairo_surface_write_to_png_stream(surface_, append, &png) != CAIRO_STATUS_SUCCESS) {
      return Failure("the picture cannot be drawn: not enough memory");
    }
    return png;
  }

 private:
  void SetColour(std::string_view hex) {
    const auto part = [&](std::size_t at) {
      return std::stoi(std::string(hex.substr(at, 2)), nullptr, 16) / 255.0;
    };
    cairo_set_source_rgb(cairo_, part(1), part(3), part(5));
  }
  void StrokeLines(const std::vector<Polyline>& polylines, std::string_view colour, double width,
                   const std::vector<double>& dashes) {
    for (const Polyline& points : polylines) {
      if (points.empty()) continue;
      cairo_move_to(cairo_, points.front().x, points.front().y);
      for (const Point& point : points) cairo_line_to(cairo_, point.x, point.y);
    }
    StrokePath(colour, width, dashes);
  }
  void StrokePath(std::string_view colour, double width, const std::vector<double>& dashes) {
    SetColour(colour);
    cairo_set_line_width(cairo_, width);
    cairo_set_dash(cairo_, dashes.data(), static_cast<int>(dashes.size()), 0);
    cairo_stroke(cairo_);
  }

  cairo_surface_t* surface_;
  cairo_t* cairo_;
};

}  // namespace

std::unique_ptr<Canvas> MakeSvgCanvas(Canvas::Size size, std::string_view title) {
  return std::make_unique<SvgCanvas>(size, title);
}

std::unique_ptr<Canvas> MakePngCanvas(Canvas::Size size) { return std::make_unique<PngCanvas>(size); }

}  // namespace axlecast
