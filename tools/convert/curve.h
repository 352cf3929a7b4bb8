#pragma once

#include <cstdint>
#include <vector>

namespace axlecast {

struct CurvePoint {
  std::int64_t us = 0;  // UNIX time
  double value = 0;
  bool operator==(const CurvePoint&) const = default;
};

// A curve for a picture of so many columns of pixels, in memory that does not grow with the readings: of each column
// it keeps the first, lowest, highest and last reading, which draw the same picture as all of them (U. Jugel et al.,
// "M4: A Visualization-Oriented Time Series Data Aggregation", VLDB 2014).
class Curve {
 public:
  // Readings stand in [first_us, last_us]; others are drawn at its ends. No line joins readings that are further apart
  // than `gap_us`.
  Curve(std::int64_t first_us, std::int64_t last_us, std::int64_t gap_us, std::size_t columns);

  // A reading later than the one before; after an earlier one (a clock was stepped) a new piece begins.
  void Add(std::int64_t us, double value);
  // No line joins the reading before to the next one.
  void Break() { joins_ = false; }

  // What to draw: lines, of at least one point each.
  using Piece = std::vector<CurvePoint>;
  [[nodiscard]] std::vector<Piece> Pieces() const;

  [[nodiscard]] std::int64_t readings() const { return readings_; }

 private:
  struct Column {
    bool used = false;
    bool joined = false;  // to the column with readings before
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
  bool joins_ = false;  // the next reading to the one before
  std::int64_t newest_us_ = 0;
  std::int64_t readings_ = 0;
};

}  // namespace axlecast
