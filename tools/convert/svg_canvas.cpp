#include "tools/convert/svg_canvas.h"

#include <array>
#include <cstdio>
#include <iterator>

#include "core/base/safe_text.h"

namespace axlecast {
namespace {

std::string Px(double value) {
  std::array<char, 40> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%.1f", value));
  return text.data();
}

const char* AnchorWord(Canvas::Anchor anchor) {
  switch (anchor) {
    case Canvas::Anchor::kMiddle:
      return "middle";
    case Canvas::Anchor::kEnd:
      return "end";
    case Canvas::Anchor::kStart:
      break;
  }
  return "start";
}

// On dark ground.
std::string DarkStyle() {
  std::string style =
      "<style>@media(prefers-color-scheme:dark){text{fill:#ddd}.ground{fill:#1c1c1c}.grid{stroke:#3a3a3a}";
  for (std::size_t i = 0; i < std::size(kCurveColours); ++i) {
    style += ".c" + std::to_string(i) + "{stroke:" + kCurveColours[i].on_dark + '}';
  }
  return style + "}</style>\n";
}

}  // namespace

SvgCanvas::SvgCanvas(Size size, std::string_view title) {
  const std::string width = Px(size.width);
  const std::string height = Px(size.height);
  text_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "\" height=\"" + height +
          "\" viewBox=\"0 0 " + width + ' ' + height +
          "\" role=\"img\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n<title>" +
          EscapedMarkup(title) + "</title>\n" + DarkStyle() +
          "<rect width=\"100%\" height=\"100%\" class=\"ground\" fill=\"#fff\"/>\n";
}

void SvgCanvas::Line(Point from, Point to, Stroke stroke) {
  const char* const style = stroke == Stroke::kAxis ? "stroke=\"#888\"" : "class=\"grid\" stroke=\"#e4e4e4\"";
  text_ += "<line x1=\"" + Px(from.x) + "\" y1=\"" + Px(from.y) + "\" x2=\"" + Px(to.x) + "\" y2=\"" + Px(to.y) +
           "\" " + style + "/>\n";
}

void SvgCanvas::Curve(const std::vector<Point>& points, std::size_t number) {
  if (points.empty()) return;
  const std::size_t colour = number % std::size(kCurveColours);
  std::string path = "M" + Px(points.front().x) + ' ' + Px(points.front().y);
  for (const Point& point : points) path += "L" + Px(point.x) + ' ' + Px(point.y);
  text_ += "<path d=\"" + path + "\" class=\"c" + std::to_string(colour) + "\" stroke=\"" +
           kCurveColours[colour].on_light +
           "\" fill=\"none\" stroke-width=\"1.5\" stroke-linecap=\"round\" stroke-linejoin=\"round\"/>\n";
}

void SvgCanvas::Text(Point at, std::string_view text, Style style) {
  text_ += "<text x=\"" + Px(at.x) + "\" y=\"" + Px(at.y) + "\" text-anchor=\"" + AnchorWord(style.anchor) + '"' +
           (style.bold ? " font-weight=\"bold\"" : "") + '>' + EscapedMarkup(text) + "</text>\n";
}

}  // namespace axlecast
