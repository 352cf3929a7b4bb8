#include "core/base/exchange_histogram.h"

#include <algorithm>
#include <numeric>

namespace axlecast {

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
