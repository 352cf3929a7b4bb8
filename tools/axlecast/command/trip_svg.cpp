#include "tools/axlecast/command/trip_svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "core/base/safe_text.h"
#include "core/base/text.h"
#include "tools/axlecast/command/trip_table.h"
#include "tools/convert/chart.h"

namespace axlecast {
namespace {

// px
constexpr double kWidth = 720;
constexpr double kLeft = 80;
constexpr double kRight = 700;
constexpr double kPlotHeight = 90;
constexpr double kPanelHeight = 150;
constexpr double kLegendRow = 20;

// Of the curves, newest first. Attributes, so that a viewer without style sheets shows them too.
constexpr std::array<const char*, 3> kStrokes = {"class=\"c0\" stroke=\"#0060a8\"",
                                                 "class=\"c1\" stroke=\"#b04a00\" stroke-dasharray=\"6 2\"",
                                                 "class=\"c2\" stroke=\"#6a3d9a\" stroke-dasharray=\"2 2\""};
constexpr const char* kAxis = "stroke=\"#888\"";
constexpr const char* kTripLine = "stroke=\"#888\" stroke-dasharray=\"4 3\"";
constexpr const char* kBold = "font-weight=\"bold\"";
constexpr const char* kCentred = "text-anchor=\"middle\"";
constexpr const char* kToTheRight = "text-anchor=\"end\"";
constexpr const char* kDark =
    "<style>@media(prefers-color-scheme:dark){text{fill:#ddd}.ground{fill:#1c1c1c}"
    ".c0{stroke:#6bb8ff}.c1{stroke:#ffa45c}.c2{stroke:#c9a6ff}}</style>\n";

std::string Px(double value) { return Decimal(value, 1); }

std::string Element(const std::string& attributes, const char* style) {
  return "<" + attributes + ' ' + style + "/>\n";
}

std::string TextAt(double x, double y, const char* style, const std::string& text) {
  return "<text x=\"" + Px(x) + "\" y=\"" + Px(y) + "\" " + style + ">" + EscapedMarkup(text) + "</text>\n";
}

std::string Line(double x1, double y1, double x2, double y2, const char* style) {
  return Element("line x1=\"" + Px(x1) + "\" y1=\"" + Px(y1) + "\" x2=\"" + Px(x2) + "\" y2=\"" + Px(y2) + '"',
                 style);
}

const char* Stroke(std::size_t trip) { return kStrokes[std::min(trip, kStrokes.size() - 1)]; }

// Around all samples of a quantity, between round numbers; without ticks when nothing was read.
RoundAxis AxisOf(const std::vector<trip_log_t>& trips, std::size_t quantity) {
  constexpr int kTicks = 3;
  double low = INFINITY;
  double high = -INFINITY;
  for (const trip_log_t& trip : trips) {
    for (std::size_t sample = 0; sample < kTripSamples; ++sample) {
      const double value = TripSample(trip, quantity, sample);
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  return low <= high ? MakeRoundAxis(low, high, kTicks) : RoundAxis{};
}

// A panel's place and scales.
struct Panel {
  double top;      // of the plot
  double first_s;  // of the oldest sample, negative
  RoundAxis values;

  [[nodiscard]] double X(double s) const { return kRight - s / first_s * (kRight - kLeft); }
  [[nodiscard]] double Y(double value) const {
    return top + kPlotHeight * (values.high - value) / (values.high - values.low);
  }
};

std::string Axes(const Panel& panel, const TripQuantity& quantity, const char* time_unit) {
  constexpr int kTimeTicks = 5;
  const double bottom = panel.top + kPlotHeight;
  std::string text =
      TextAt(kLeft, panel.top - 8, kBold, std::string(quantity.name) + ", " + std::string(quantity.unit));
  text += Line(kLeft, panel.top, kLeft, bottom, kAxis) + Line(kLeft, bottom, kRight, bottom, kAxis) +
          Line(kRight, panel.top, kRight, bottom, kTripLine);
  for (const Tick& tick : MakeRoundAxis(panel.first_s, 0, kTimeTicks).ticks) {
    if (tick.at < panel.first_s * (1 + 1e-9)) continue;  // before the oldest sample
    text += Line(panel.X(tick.at), bottom, panel.X(tick.at), bottom + 4, kAxis) +
            TextAt(panel.X(tick.at), bottom + 17, kCentred, tick.label);
  }
  text += TextAt((kLeft + kRight) / 2, bottom + 32, kCentred, std::string("time before the trip, ") + time_unit);
  if (panel.values.ticks.empty()) return text + TextAt(kLeft + 10, panel.top + kPlotHeight / 2, "", "not read");
  for (const Tick& tick : panel.values.ticks) {
    text += Line(kLeft - 4, panel.Y(tick.at), kLeft, panel.Y(tick.at), kAxis) +
            TextAt(kLeft - 7, panel.Y(tick.at) + 4, kToTheRight, tick.label);
  }
  return text;
}

// The samples that were read, and a circle at the trip.
std::string Curve(const Panel& panel, const trip_log_t& trip, std::size_t quantity, std::size_t index) {
  std::string path;
  bool drawing = false;
  for (std::size_t sample = 0; sample < kTripSamples; ++sample) {
    const double value = TripSample(trip, quantity, sample);
    if (std::isfinite(value)) {
      path += (drawing ? "L" : "M") + Px(panel.X(TripTime(trip, sample))) + ' ' + Px(panel.Y(value));
    }
    drawing = std::isfinite(value);
  }
  if (path.empty()) return "";
  std::string text = Element("path d=\"" + path + "\" fill=\"none\" stroke-width=\"1.5\"", Stroke(index));
  if (drawing) {
    const double last = TripSample(trip, quantity, kTripSamples - 1);
    text += Element("circle cx=\"" + Px(panel.X(0)) + "\" cy=\"" + Px(panel.Y(last)) +
                        "\" r=\"4\" fill=\"none\" stroke-width=\"2\"",
                    Stroke(index));
  }
  return text;
}

std::string Legend(const std::vector<trip_log_t>& trips) {
  std::string text;
  for (std::size_t i = 0; i < trips.size(); ++i) {
    const double y = 30 + kLegendRow * static_cast<double>(i + 1);
    text += Line(kLeft, y - 4, kLeft + 30, y - 4, Stroke(i)) +
            TextAt(kLeft + 40, y, "", TripTitle(trips[i]) + (i == 0 ? " (newest)" : ""));
  }
  return text;
}

}  // namespace

std::string TripSvg(const std::string& device, const std::vector<trip_log_t>& trips) {
  double first_s = 0;
  for (const trip_log_t& trip : trips) first_s = std::min(first_s, TripTime(trip, 0));
  const double head = 70 + kLegendRow * static_cast<double>(trips.size());
  const double height = head + kPanelHeight * static_cast<double>(std::size(kTripQuantities));
  const std::string size =
      Px(kWidth) + "\" height=\"" + Px(height) + "\" viewBox=\"0 0 " + Px(kWidth) + ' ' + Px(height);
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + size +
                     "\" role=\"img\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n<title>" +
                     EscapedMarkup(device) + ": trips</title>\n" + kDark +
                     Element("rect width=\"100%\" height=\"100%\"", "class=\"ground\" fill=\"#fff\"");
  text += TextAt(kLeft, 26, kBold, device + ": what was before each trip; circles mark the trip") + Legend(trips);
  if (trips.empty()) return text + TextAt(kLeft, 50, "", "no trip is recorded") + "</svg>\n";
  const bool in_seconds = std::all_of(trips.begin(), trips.end(), [](const auto& t) { return t.interval_us > 0; });
  for (std::size_t quantity = 0; quantity < std::size(kTripQuantities); ++quantity) {
    const Panel panel{head + kPanelHeight * static_cast<double>(quantity), first_s, AxisOf(trips, quantity)};
    text += Axes(panel, kTripQuantities[quantity], in_seconds ? "s" : "samples");
    for (std::size_t i = 0; i < trips.size(); ++i) text += Curve(panel, trips[i], quantity, i);
  }
  return text + "</svg>\n";
}

}  // namespace axlecast
