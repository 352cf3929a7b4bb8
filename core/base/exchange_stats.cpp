#include "core/base/exchange_stats.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace axlecast {

void ExchangeStats::Add(MonoNs duration) {
  duration = std::max<MonoNs>(duration, 0);
  min_ = count_ == 0 ? duration : std::min(min_, duration);
  max_ = std::max(max_, duration);
  ++count_;
  ++buckets_[BucketOf(static_cast<std::uint64_t>(duration))];
}

void ExchangeStats::Clear() { *this = {}; }

MonoNs ExchangeStats::Percentile(double q) const {
  if (count_ == 0) return 0;
  const std::int64_t rank = std::max<std::int64_t>(1, std::llround(std::ceil(q * static_cast<double>(count_))));
  std::int64_t below = 0;
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    below += buckets_[bucket];
    if (below >= rank) return std::clamp(MiddleOf(bucket), min_, max_);
  }
  return max_;
}

std::size_t ExchangeStats::BucketOf(std::uint64_t duration) {
  duration = std::min(duration, (std::uint64_t{1} << (kTopBit + 1)) - 1);
  const int octave = std::max(0, static_cast<int>(std::bit_width(duration)) - 1 - kSubBits);
  return (static_cast<std::size_t>(octave) << kSubBits) + static_cast<std::size_t>(duration >> octave);
}

MonoNs ExchangeStats::MiddleOf(std::size_t bucket) {
  const std::size_t cell = bucket >> kSubBits;
  if (cell < 2) return static_cast<MonoNs>(bucket);
  const std::size_t octave = cell - 1;
  const std::size_t mantissa = bucket - (octave << kSubBits);
  return static_cast<MonoNs>((mantissa << octave) + ((std::size_t{1} << octave) >> 1));
}

void ExchangeHistogram::Add(MonoNs duration) {
  duration = std::max<MonoNs>(duration, 0);
  ++total_;
  sum_ += duration;
  const auto bucket =
      std::lower_bound(kBoundsUs.begin(), kBoundsUs.end(), duration,
                       [](std::int32_t bound_us, MonoNs took) { return bound_us * kMicrosecond < took; });
  if (bucket != kBoundsUs.end()) ++counts_[static_cast<std::size_t>(bucket - kBoundsUs.begin())];
}

std::array<std::int64_t, ExchangeHistogram::kBoundsUs.size()> ExchangeHistogram::Within() const {
  std::array<std::int64_t, kBoundsUs.size()> within{};
  std::partial_sum(counts_.begin(), counts_.end(), within.begin());
  return within;
}

}  // namespace axlecast
