#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "tools/convert/conversion.h"
#include "tools/convert/curve.h"

namespace axlecast {

// What one curve shows: a channel, and a field of its messages by its name in JSON.
struct PlotField {
  std::string channel;
  std::string field;
  [[nodiscard]] std::string Name() const { return channel + ':' + field; }
};

// Parses "POSITION/axis1:value" or "MOTOR/gm1:accel_mps2[0]". Returns nothing if the text has another form.
[[nodiscard]] std::optional<PlotField> ParsePlotField(std::string_view text);

// Returns the field's unit for display: from the message ("mm" for a position's `value`), else from the ending of its name
// ("°C" for temperature_c). Empty if there is no unit.
[[nodiscard]] std::string FieldUnit(const nlohmann::ordered_json& message, std::string_view field);

struct PlotCurve {
  PlotField field;
  std::string unit;
  std::vector<Curve::Piece> pieces;
  std::int64_t readings = 0;
};

// The content of a plot.
struct PlotData {
  std::int64_t first_us = 0;
  std::int64_t last_us = 0;
  std::vector<PlotCurve> curves;
};

// Collects the readings of these fields over the times of their messages, for a picture with `columns` pixel columns. Each
// sample of a message with a list `dt_ns` (position_block_t) is a reading. A curve is interrupted
// - where a message is missing according to `seq`,
// - where its publisher restarted,
// - at a value that is null or not valid,
// - where the interval between messages exceeds 8 times the usual interval.
// If a channel or field does not occur, the error lists those that do.
[[nodiscard]] Result<PlotData> CollectPlot(const EventRange& events, const std::vector<PlotField>& fields,
                                           std::size_t columns);

// The number of pixel columns that a picture has for its curves.
inline constexpr std::size_t kPlotColumns = 880;

// Draws the curves over UTC. Curves of one unit share a panel; panels are below each other, each with a legend and axes.
[[nodiscard]] Result<std::string> PlotSvg(const std::string& title, const PlotData& data);
[[nodiscard]] Result<std::string> PlotPng(const std::string& title, const PlotData& data);

}  // namespace axlecast
