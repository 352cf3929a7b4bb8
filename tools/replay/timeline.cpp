#include "tools/replay/timeline.h"

#include <algorithm>
#include <cmath>

namespace axlecast {
namespace {

// 146 years: what a damaged time can ask for at most.
constexpr double kFarthest = 4.6e18;

}  // namespace

void Timeline::Anchor(MonoNs now, std::int64_t utime) {
  anchor_ = now;
  anchor_utime_ = utime;
}

void Timeline::Splice(std::int64_t from, std::int64_t to) {
  if (!paused_) anchor_ = Instant(from);
  anchor_utime_ = to;
}

void Timeline::Pause(MonoNs now) {
  if (paused_) return;
  Anchor(now, Utime(now));
  paused_ = true;
}

void Timeline::Resume(MonoNs now) {
  if (!paused_) return;
  anchor_ = now;
  paused_ = false;
}

void Timeline::SetSpeed(double speed, MonoNs now) {
  Anchor(now, Utime(now));
  speed_ = speed;
}

MonoNs Timeline::Instant(std::int64_t utime) const {
  if (speed_ == 0) return anchor_;
  // A double's 53 bits hold 100 days to 1 ns, and a UNIX time to 1 us.
  const double us = static_cast<double>(utime) - static_cast<double>(anchor_utime_);
  const double ns = us * static_cast<double>(kMicrosecond) / speed_;
  return static_cast<MonoNs>(std::clamp(static_cast<double>(anchor_) + ns, -kFarthest, kFarthest));
}

std::int64_t Timeline::Utime(MonoNs now) const {
  if (paused_ || speed_ == 0) return anchor_utime_;
  const double us = static_cast<double>(now - anchor_) / static_cast<double>(kMicrosecond) * speed_;
  return static_cast<std::int64_t>(
      std::clamp(static_cast<double>(anchor_utime_) + std::round(us), -kFarthest, kFarthest));
}

}  // namespace axlecast
