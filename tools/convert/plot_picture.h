#pragma once

#include <string>

#include "tools/convert/plot_data.h"

namespace axlecast {

// How wide pictures are, px, and how many of these columns hold the curves.
inline constexpr int kPlotWidth = 1'000;
inline constexpr std::size_t kPlotColumns = 880;

// The curves over time (UTC): those of one unit in one panel, panels below each other, each with a legend and axes at
// round numbers.
[[nodiscard]] std::string PlotSvg(const std::string& title, const PlotData& data);

// The same as PNG; empty when there is no memory for it.
[[nodiscard]] std::string PlotPng(const std::string& title, const PlotData& data);

}  // namespace axlecast
