#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace axlecast {

// The newest readings of one device, as rows of numbers. Rows are numbered from 0 and keep their number; old ones go.
class SampleHistory {
 public:
  // `columns` numbers a row; at most `most` rows are kept.
  SampleHistory(std::size_t columns, std::size_t maximum) : columns_(columns), most_(maximum) {}

  // Where time runs back (somebody set the clock), what was before is void: the rows so far go.
  void Add(std::int64_t utime, std::span<const double> row);

  [[nodiscard]] std::size_t columns() const { return columns_; }
  [[nodiscard]] std::uint64_t begin() const { return begin_; }  // the oldest row that is kept
  [[nodiscard]] std::uint64_t end() const { return end_; }      // behind the newest
  // Of a row within these.
  [[nodiscard]] std::int64_t utime(std::uint64_t row) const { return times_[row % most_]; }
  [[nodiscard]] double value(std::uint64_t row, std::size_t column) const {
    return values_[(row % most_) * columns_ + column];
  }
  // The first row that is kept and not before `utime`.
  [[nodiscard]] std::uint64_t Find(std::int64_t utime) const;

 private:
  std::size_t columns_;
  std::size_t most_;
  std::uint64_t begin_ = 0;
  std::uint64_t end_ = 0;
  std::vector<std::int64_t> times_;  // of row n at n modulo most_
  std::vector<double> values_;
};

}  // namespace axlecast
