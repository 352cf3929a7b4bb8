#include "tools/web/sample_history.h"

#include <algorithm>

namespace axlecast {

void SampleHistory::Add(std::int64_t utime, std::span<const double> row) {
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

std::uint64_t SampleHistory::Find(std::int64_t utime) const {
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

}  // namespace axlecast
