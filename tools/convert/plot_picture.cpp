#include <algorithm>
#include <cmath>

#include "tools/convert/chart.h"
#include "tools/convert/plot.h"

namespace axlecast {
namespace {

// px
constexpr double kPlotWidth = 1'000;
constexpr double kLeft = 100;
constexpr double kRight = kLeft + static_cast<double>(kPlotColumns);
constexpr double kHead = 40;
constexpr double kPanelHead = 24;
constexpr double kLegendRow = 18;
constexpr double kPlotHeight = 220;
constexpr double kPanelFoot = 50;

// Curves that share an axis.
struct CurveGroup {
  std::string unit;
  std::vector<std::size_t> curves;  // indexes into PlotData::curves

  [[nodiscard]] double LegendHeight() const { return kLegendRow * static_cast<double>(curves.size()); }
  [[nodiscard]] double Height() const { return kPanelHead + LegendHeight() + kPlotHeight + kPanelFoot; }
};

// Groups curves by unit. Curves without a unit share a panel if they show the same field.
std::vector<CurveGroup> GroupCurves(const PlotData& data) {
  std::vector<CurveGroup> groups;
  for (std::size_t i = 0; i < data.curves.size(); ++i) {
    const PlotCurve& curve = data.curves[i];
    const std::string unit = curve.unit.empty() ? curve.field.field : curve.unit;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const CurveGroup& g) { return g.unit == unit; });
    if (group == groups.end()) group = groups.insert(groups.end(), CurveGroup{unit, {}});
    group->curves.push_back(i);
  }
  return groups;
}

RoundAxis ValueAxis(const PlotData& data, const CurveGroup& group) {
  constexpr int kTicks = 5;
  double low = INFINITY;
  double high = -INFINITY;
  for (const std::size_t number : group.curves) {
    for (const Curve::Piece& piece : data.curves[number].pieces) {
      for (const CurvePoint& point : piece) {
        low = std::min(low, point.value);
        high = std::max(high, point.value);
      }
    }
  }
  return MakeRoundAxis(low, high, kTicks);
}

// `y`: the top of the legend.
void DrawLegend(Canvas& canvas, const PlotData& data, const CurveGroup& group, double y) {
  for (const std::size_t number : group.curves) {
    y += kLegendRow;
    const PlotCurve& curve = data.curves[number];
    canvas.DrawLegendLine({kLeft, y - 10}, {kLeft + 30, y - 10}, {.number = number});
    canvas.DrawText({kLeft + 38, y - 6}, curve.field.Name() + (curve.readings == 0 ? " (no reading)" : ""), {});
  }
}

void DrawGroup(Canvas& canvas, const PlotData& data, const CurveGroup& group, double top) {
  constexpr int kTimeTicks = 8;
  const double head = top + kPanelHead;
  const double plot_top = head + group.LegendHeight();
  const auto first_us = static_cast<double>(data.first_us);
  const ChartPanel panel = {.left = kLeft,
                            .right = kRight,
                            .top = plot_top,
                            .bottom = plot_top + kPlotHeight,
                            .first_x = first_us,
                            .last_x = std::max(static_cast<double>(data.last_us), first_us + 1),
                            .values = ValueAxis(data, group)};
  const TimeAxis times = MakeTimeAxis(data.first_us, data.last_us, kTimeTicks);
  canvas.DrawText({kLeft, head - 8}, group.unit, {.bold = true});
  DrawLegend(canvas, data, group, head);
  DrawAxes(canvas, panel, times.ticks, times.title);
  for (const std::size_t number : group.curves) {
    std::vector<Canvas::Polyline> polylines;
    for (const Curve::Piece& piece : data.curves[number].pieces) {
      Canvas::Polyline& points = polylines.emplace_back();
      for (const CurvePoint& point : piece) {
        points.push_back(panel.At(static_cast<double>(point.us), point.value));
      }
    }
    canvas.DrawCurve(polylines, {.number = number});
  }
}

double Height(const PlotData& data) {
  double height = kHead;
  for (const CurveGroup& group : GroupCurves(data)) height += group.Height();
  return height;
}

Result<std::string> Draw(Canvas& canvas, const std::string& title, const PlotData& data) {
  canvas.DrawText({kLeft, 26}, title, {.bold = true});
  double top = kHead;
  for (const CurveGroup& group : GroupCurves(data)) {
    DrawGroup(canvas, data, group, top);
    top += group.Height();
  }
  return canvas.Finish();
}

}  // namespace

Result<std::string> PlotSvg(const std::string& title, const PlotData& data) {
  return Draw(*MakeSvgCanvas({kPlotWidth, Height(data)}, title), title, data);
}

Result<std::string> PlotPng(const std::string& title, const PlotData& data) {
  return Draw(*MakePngCanvas({kPlotWidth, Height(data)}), title, data);
}

}  // namespace axlecast
