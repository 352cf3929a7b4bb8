#include "core/base/time.h"

#include <algorithm>
#include <cstdlib>

namespace axlecast {

bool Timebase::Update(MonoNs now, std::int64_t utc_us) {
  constexpr std::int64_t kStepUs = 1'000;
  constexpr MonoNs kNsPerSlewedUs = 2'000'000;  // 500 us per second
  const std::int64_t target = utc_us - now / kMicrosecond;
  const std::int64_t difference = target - offset_us_;
  if (!started_ || std::abs(difference) > kStepUs) {
    const bool stepped = started_;
    started_ = true;
    offset_us_ = target;
    updated_ = now;
    steps_ += stepped ? 1 : 0;
    return stepped;
  }
  const std::int64_t maximum = (now - updated_) / kNsPerSlewedUs;
  if (maximum == 0) return false;
  offset_us_ += std::clamp(difference, -maximum, maximum);
  updated_ = now;
  return false;
}

}  // namespace axlecast
