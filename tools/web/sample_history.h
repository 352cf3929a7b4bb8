#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace axlecast {

// The newest readings of one device as rows of numbers. Rows are numbered from 0 and keep their number; old rows are dropped.
class SampleHistory {
 public:
  // Keeps at most `maximum` rows of `columns` numbers.
  SampleHistory(std::size_t columns, std::size_t maximum) : columns_(columns), max_rows_(maximum) {}

  // Adds a row. If it is earlier than the last row (the clock was set back), all previous rows are dropped.
  void Add(std::int64_t utime, std::span<const double> row) {
    if (begin_ < end_ && utime < this->utime(end_ - 1)) begin_ = end_;
    const std::size_t place = end_ % max_rows_;
    if (place == times_.size()) {
      times_.push_back(utime);
      values_.insert(values_.end(), row.begin(), row.end());
    } else {
      times_[place] = utime;
      std::copy(row.begin(), row.end(), values_.begin() + static_cast<std::ptrdiff_t>(place * columns_));
    }
    ++end_;
    begin_ = std::max(begin_, end_ > max_rows_ ? end_ - max_rows_ : 0);
  }

  [[nodiscard]] std::size_t columns() const { return columns_; }
  [[nodiscard]] std::uint64_t begin() const { return begin_; }  // the oldest row that is kept
  [[nodiscard]] std::uint64_t end() const { return end_; }      // after the newest
  // `row` must be within [begin(), end()).
  [[nodiscard]] std::int64_t utime(std::uint64_t row) const { return times_[row % max_rows_]; }
  [[nodiscard]] double value(std::uint64_t row, std::size_t column) const {
    return values_[(row % max_rows_) * columns_ + column];
  }
  // Returns the first stored row that is not before `utime`.
  [[nodiscard]] std::uint64_t Find(std::int64_t utime) const {
    std::uint64_t low = begin_;
    std::uint64_t high = end_;
    while (low < high) {
      const std::uint64_t middle = low + (high - low) / 2;
      if (this->utime(middle) < utime) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

 private:
  std::size_t columns_;
  std::size_t max_rows_;
  std::uint64_t begin_ = 0;
  std::uint64_t end_ = 0;
  std::vector<std::int64_t> times_;  // of row n at n modulo max_rows_
  std::vector<double> values_;
};

}  // namespace axlecast
