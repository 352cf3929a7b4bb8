#include "tools/convert/message_gap.h"

#include <algorithm>
#include <bit>

namespace axlecast {

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
