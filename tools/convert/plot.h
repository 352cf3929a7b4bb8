#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "tools/convert/conversion.h"

namespace axlecast {

struct CurvePoint {
  std::int64_t us = 0;  // UNIX time
  double value = 0;
  bool operator==(const CurvePoint&) const = default;
};

// A curve for a picture with a given number of pixel columns. Its memory does not grow with the number of readings: it
// keeps the first, lowest, highest and last reading of each column. They draw the same picture as all readings (U. Jugel
// et al., "M4: A Visualization-Oriented Time Series Data Aggregation", VLDB 2014).
class Curve {
 public:
  // Readings outside [first_us, last_us] are drawn at its ends. Readings further apart than `gap_us` are not joined.
  Curve(std::int64_t first_us, std::int64_t last_us, std::int64_t gap_us, std::size_t columns);

  // Adds a reading. If it is earlier than the previous one (a clock was set back), a new piece begins.
  void Add(std::int64_t us, double value);
  // Begins a new piece with the next reading.
  void Break() { joins_ = false; }

  // Returns the polylines to draw, with at least one point each.
  using Piece = std::vector<CurvePoint>;
  [[nodiscard]] std::vector<Piece> Pieces() const;

  [[nodiscard]] std::int64_t readings() const { return readings_; }

 private:
  struct Column {
    bool used = false;
    bool joined = false;  // to the previous column that has readings
    CurvePoint first;
    CurvePoint lowest;
    CurvePoint highest;
    CurvePoint last;
  };

  [[nodiscard]] Column& At(std::int64_t us);

  std::int64_t first_us_;
  std::int64_t last_us_;
  std::int64_t gap_us_;
  std::vector<Column> columns_;
  bool joins_ = false;  // the next reading is joined to the previous one
  std::int64_t newest_us_ = 0;
  std::int64_t readings_ = 0;
};

// Measures the usual interval between the messages of a channel.
class MessageGap {
 public:
  void On(std::int64_t us);

  // Returns 8 times the median interval in us, which is known to a power of two. A longer interval is a gap.
  [[nodiscard]] std::int64_t Limit() const;

 private:
  static constexpr std::size_t kPowers = 48;
  std::array<std::int64_t, kPowers> counts_{};  // of intervals below 1, 2, 4, 8... us
  std::int64_t total_ = 0;
  std::int64_t last_us_ = -1;
};

// What one curve shows: a channel, and a field of its messages by its name in JSON.
struct PlotField {
  std::string channel;
  std::string field;
  [[nodiscard]] std::string Name() const { return channel + ':' + field; }
};

// Parses "POSITION/axis1:value" or "MOTOR/gm1:accel_mps2[0]". Returns nothing if the text has another form.
[[nodiscard]] std::optional<PlotField> ParsePlotField(std::string_view text);

// Returns the field's unit for display, or an empty text: from the message ("mm" for a position's `value`), else from the ending
// of its name ("°C" for temperature_c).
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
