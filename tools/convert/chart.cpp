#include "tools/convert/chart.h"

#include <cairo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "core/base/text.h"
#include "core/base/utc_text.h"

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

// Returns the time with as many decimals of a second as the step needs.
std::string TimeLabel(std::int64_t us, std::int64_t step) {
  if (step >= kDayUs) return FormatUtc(us, "%Y-%m-%d");
  if (step % (60 * kSecondUs) == 0) return FormatUtc(us, "%H:%M");
  std::string label = FormatUtc(us, "%H:%M:%S");
  if (step % kSecondUs == 0) return label;
  std::array<char, 16> fraction{};
  static_cast<void>(std::snprintf(fraction.data(), fraction.size(), ".%06d", static_cast<int>(us % kSecondUs)));
  label += fraction.data();
  for (std::int64_t unit = 10; step % unit == 0; unit *= 10) label.pop_back();
  return label;
}

}  // namespace

std::unique_ptr<Canvas> MakeSvgCanvas(Canvas::Size size, std::string_view title) {
  return std::make_unique<SvgCanvas>(size, title);
}

std::unique_ptr<Canvas> MakePngCanvas(Canvas::Size size) { return std::make_unique<PngCanvas>(size); }

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
  const std::string first_day = FormatUtc(first_us, "%Y-%m-%d");
  const std::string last_day = FormatUtc(last_us, "%Y-%m-%d");
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
