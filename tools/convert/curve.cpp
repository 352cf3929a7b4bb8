#include "tools/convert/curve.h"

#include <algorithm>
#include <bit>

namespace axlecast {
namespace {

constexpr auto kEarlier = [](const CurvePoint& a, const CurvePoint& b) { return a.us < b.us; };

}  // namespace

Curve::Curve(std::int64_t first_us, std::int64_t last_us, std::int64_t gap_us, std::size_t columns)
    : first_us_(first_us), last_us_(std::max(first_us, last_us)), gap_us_(gap_us), columns_(columns) {}

Curve::Column& Curve::At(std::int64_t us) {
  const double part = (static_cast<double>(us) - static_cast<double>(first_us_)) /
                      std::max(static_cast<double>(last_us_) - static_cast<double>(first_us_), 1.0);
  const auto columns = static_cast<double>(columns_.size());
  return columns_[static_cast<std::size_t>(std::clamp(part * columns, 0.0, columns - 1))];
}

void Curve::Add(std::int64_t us, double value) {
  us = std::clamp(us, first_us_, last_us_);
  if (us < newest_us_ || us - newest_us_ > gap_us_) joins_ = false;
  const CurvePoint point{us, value};
  Column& column = At(us);
  if (!column.used) {
    column = {.used = true, .joined = joins_, .first = point, .lowest = point, .highest = point, .last = point};
  }
  if (us < column.first.us) column.first = point;
  if (value < column.lowest.value) column.lowest = point;
  if (value > column.highest.value) column.highest = point;
  if (us >= column.last.us) column.last = point;
  joins_ = true;
  newest_us_ = us;
  ++readings_;
}

std::vector<Curve::Piece> Curve::Pieces() const {
  std::vector<Piece> pieces;
  for (const Column& column : columns_) {
    if (!column.used) continue;
    if (pieces.empty() || !column.joined) pieces.emplace_back();
    Piece points = {column.first, column.lowest, column.highest, column.last};
    std::stable_sort(points.begin() + 1, points.end() - 1, kEarlier);
    points.erase(std::unique(points.begin(), points.end()), points.end());
    pieces.back().insert(pieces.back().end(), points.begin(), points.end());
  }
  return pieces;
}

void MessageGap::On(std::int64_t us) {
  if (last_us_ >= 0 && us > last_us_) {
    const auto power = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(us - last_us_)));
    ++counts_[std::min(power, kPowers - 1)];
    ++total_;
  }
  last_us_ = us;
}

std::int64_t MessageGap::Limit() const {
  constexpr std::size_t kEight = 3;
  std::int64_t below = 0;
  for (std::size_t power = 0; power < kPowers; ++power) {
    below += counts_[power];
    if (below > 0 && 2 * below >= total_) return std::int64_t{1} << (power + kEight);
  }
  return INT64_MAX;
}

}  // namespace axlecast
