#include "tools/convert/plot_picture.h"

#include <algorithm>
#include <cmath>

#include "tools/convert/plot_ticks.h"
#include "tools/convert/png_canvas.h"
#include "tools/convert/svg_canvas.h"

namespace axlecast {
namespace {

using Point = Canvas::Point;
using Anchor = Canvas::Anchor;

// px
constexpr double kLeft = 100;
constexpr double kRight = kLeft + static_cast<double>(kPlotColumns);
constexpr double kHead = 40;
constexpr double kPanelHead = 24;
constexpr double kLegendRow = 18;
constexpr double kPlotHeight = 220;
constexpr double kPanelFoot = 50;

// Curves that share an axis.
struct Panel {
  std::string unit;
  std::vector<std::size_t> curves;  // by their number
};

// Curves without a unit share a panel when they show the same field.
std::vector<Panel> MakePanels(const PlotData& data) {
  std::vector<Panel> panels;
  for (std::size_t i = 0; i < data.curves.size(); ++i) {
    const PlotCurve& curve = data.curves[i];
    const std::string unit = curve.unit.empty() ? curve.field.field : curve.unit;
    auto panel = std::find_if(panels.begin(), panels.end(), [&](const Panel& p) { return p.unit == unit; });
    if (panel == panels.end()) panel = panels.insert(panels.end(), Panel{unit, {}});
    panel->curves.push_back(i);
  }
  return panels;
}

double HeightOf(const Panel& panel) {
  return kPanelHead + kLegendRow * static_cast<double>(panel.curves.size()) + kPlotHeight + kPanelFoot;
}

double HeightOf(const std::vector<Panel>& panels) {
  double height = kHead;
  for (const Panel& panel : panels) height += HeightOf(panel);
  return height;
}

RoundAxis ValueAxis(const PlotData& data, const Panel& panel) {
  constexpr int kTicks = 5;
  double low = INFINITY;
  double high = -INFINITY;
  for (const std::size_t number : panel.curves) {
    for (const Curve::Piece& piece : data.curves[number].pieces) {
      for (const CurvePoint& point : piece) {
        low = std::min(low, point.value);
        high = std::max(high, point.value);
      }
    }
  }
  return low <= high ? MakeRoundAxis(low, high, kTicks) : RoundAxis{};
}

// A panel's place and scales.
class PanelDrawing {
 public:
  PanelDrawing(Canvas& canvas, const PlotData& data, const Panel& panel, double top)
      : canvas_(canvas), data_(data), panel_(panel), values_(ValueAxis(data, panel)), head_(top + kPanelHead) {
    top_ = head_ + kLegendRow * static_cast<double>(panel.curves.size());
    bottom_ = top_ + kPlotHeight;
  }

  void Draw() const {
    canvas_.Text({kLeft, head_ - 8}, panel_.unit, {.bold = true});
    DrawLegend();
    DrawValueAxis();
    DrawTimeAxis();
    for (const std::size_t number : panel_.curves) {
      for (const Curve::Piece& piece : data_.curves[number].pieces) DrawPiece(piece, number);
    }
  }

 private:
  [[nodiscard]] double X(double us) const {
    const double span = static_cast<double>(data_.last_us) - static_cast<double>(data_.first_us);
    return kLeft + (us - static_cast<double>(data_.first_us)) / std::max(span, 1.0) * (kRight - kLeft);
  }
  [[nodiscard]] double Y(double value) const {
    return top_ + kPlotHeight * (values_.high - value) / (values_.high - values_.low);
  }

  void DrawLegend() const {
    double y = head_ + kLegendRow - 6;
    for (const std::size_t number : panel_.curves) {
      const PlotCurve& curve = data_.curves[number];
      canvas_.Curve({{kLeft, y - 4}, {kLeft + 30, y - 4}}, number);
      canvas_.Text({kLeft + 38, y}, curve.field.Name() + (curve.readings == 0 ? " (no reading)" : ""), {});
      y += kLegendRow;
    }
  }
  void DrawValueAxis() const {
    for (const Tick& tick : values_.ticks) {
      canvas_.Line({kLeft, Y(tick.at)}, {kRight, Y(tick.at)}, Canvas::Stroke::kGrid);
      canvas_.Text({kLeft - 7, Y(tick.at) + 4}, tick.label, {.anchor = Anchor::kEnd});
    }
    canvas_.Line({kLeft, top_}, {kLeft, bottom_}, Canvas::Stroke::kAxis);
  }
  void DrawTimeAxis() const {
    constexpr int kTicks = 8;
    const TimeAxis axis = MakeTimeAxis(data_.first_us, data_.last_us, kTicks);
    for (const Tick& tick : axis.ticks) {
      canvas_.Line({X(tick.at), bottom_}, {X(tick.at), bottom_ + 4}, Canvas::Stroke::kAxis);
      canvas_.Text({X(tick.at), bottom_ + 17}, tick.label, {.anchor = Anchor::kMiddle});
    }
    canvas_.Line({kLeft, bottom_}, {kRight, bottom_}, Canvas::Stroke::kAxis);
    canvas_.Text({(kLeft + kRight) / 2, bottom_ + 33}, axis.title, {.anchor = Anchor::kMiddle});
  }
  void DrawPiece(const Curve::Piece& piece, std::size_t number) const {
    std::vector<Point> points;
    points.reserve(piece.size());
    for (const CurvePoint& point : piece) points.push_back({X(static_cast<double>(point.us)), Y(point.value)});
    canvas_.Curve(points, number);
  }

  Canvas& canvas_;
  const PlotData& data_;
  const Panel& panel_;
  RoundAxis values_;
  double head_;
  double top_ = 0;  // of the plot
  double bottom_ = 0;
};

void DrawPlot(Canvas& canvas, const std::string& title, const PlotData& data, const std::vector<Panel>& panels) {
  canvas.Text({kLeft, 26}, title, {.bold = true});
  double top = kHead;
  for (const Panel& panel : panels) {
    PanelDrawing(canvas, data, panel, top).Draw();
    top += HeightOf(panel);
  }
}

}  // namespace

std::string PlotSvg(const std::string& title, const PlotData& data) {
  const std::vector<Panel> panels = MakePanels(data);
  SvgCanvas canvas({kPlotWidth, HeightOf(panels)}, title);
  DrawPlot(canvas, title, data, panels);
  return canvas.Svg();
}

std::string PlotPng(const std::string& title, const PlotData& data) {
  const std::vector<Panel> panels = MakePanels(data);
  PngCanvas canvas({kPlotWidth, HeightOf(panels)});
  DrawPlot(canvas, title, data, panels);
  return canvas.Png();
}

}  // namespace axlecast
