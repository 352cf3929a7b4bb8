#include "drivers/runtime/axis/speed.h"

#include <algorithm>
#include <limits>

namespace axlecast {

void Speed::Add(const UnwrappedSample& fix) {
  last_ = fix;
  if (size_ > 0 && fix.at.Middle() - Back(0).at.Middle() < kSpacing) return;
  newest_ = (newest_ + 1) % kSize;
  ring_[newest_] = fix;
  size_ = std::min(size_ + 1, kSize);
}

bool Speed::Known(std::size_t used) const {
  if (used < 2) return false;
  const UnwrappedSample& oldest = Back(used - 1);
  const MonoNs span = last_.at.Middle() - oldest.at.Middle();
  return span >= kShortest && (last_.at.HalfWidth() + oldest.at.HalfWidth()) * 4 <= span;
}

std::size_t Speed::Used() const {
  std::size_t used = 0;
  while (used < size_) {
    const MonoNs age = last_.at.Middle() - Back(used).at.Middle();
    if (age > kLongest || (age > kWindow && Known(used))) break;
    ++used;
  }
  return used;
}

double Speed::CountsPerSecond() const {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const std::size_t used = Used();
  if (!Known(used)) return kUnknown;
  // Least squares about the last reading; the last one counts even where it is not in the ring.
  double n = 0;
  double t_sum = 0;
  double x_sum = 0;
  double tt_sum = 0;
  double tx_sum = 0;
  const auto add = [&](const UnwrappedSample& fix) {
    const double t = static_cast<double>(fix.at.Middle() - last_.at.Middle());
    const double x = static_cast<double>(fix.counts - last_.counts);
    n += 1;
    t_sum += t;
    x_sum += x;
    tt_sum += t * t;
    tx_sum += t * x;
  };
  if (Back(0).at.Middle() != last_.at.Middle()) add(last_);
  for (std::size_t i = 0; i < used; ++i) add(Back(i));
  return (n * tx_sum - t_sum * x_sum) / (n * tt_sum - t_sum * t_sum) * static_cast<double>(kSecond);
}

}  // namespace axlecast
