#pragma once

#include <cstdint>

#include "core/device/device.h"
#include "drivers/runtime/axis/unwrapped_sample.h"

namespace axlecast {

// Whether the shaft stands still, from its good readings.
//
// Standstill: at least two readings that cover 40 ms or more, the last at most 120 ms old, all within the tolerance
// of each other: 0.1 degrees, or 2 counts where that is more, beyond twice the noise of the encoder. Ten requests
// of a reset sequence, 40 ms apart, suffice to keep watching.
//
// Readings so far apart that a whole turn fits between them (`continuous` false) keep up a standstill that was seen
// before, but cannot establish one: a shaft at 1,500 min-1 stands at the same angle every 40 ms.
class Standstill {
 public:
  Standstill(std::int64_t counts_per_turn, std::int64_t noise_counts);

  void Add(const UnwrappedSample& fix, bool continuous);
  // The same shaft position is counted differently from the next reading on.
  void Forget() { any_ = false; }
  [[nodiscard]] Motion At(MonoNs now) const;

  static constexpr MonoNs kCover = 40 * kMillisecond;
  static constexpr MonoNs kOldest = 120 * kMillisecond;

 private:
  void BeginWatch(const UnwrappedSample& fix);
  void BeginWindow(const UnwrappedSample& fix);
  void Extend(const UnwrappedSample& fix, bool continuous);
  void MeasureSpeed(const UnwrappedSample& fix);

  std::int64_t counts_per_turn_;
  std::int64_t tolerance_;
  bool any_ = false;
  UnwrappedSample last_;
  MonoNs watched_since_ = 0;  // readings have come without a long gap since
  // The present window: every reading since `since_` lies within [least_, most_].
  MonoNs since_ = 0;
  std::int64_t least_ = 0;
  std::int64_t most_ = 0;
  bool established_ = false;  // it covered kCover by readings that exclude whole turns in between
  bool moved_ = false;        // a window ended because the shaft moved
  // Largest speed in counts per ns over steps of 5 ms or more, in this and in the last stretch of kCover.
  UnwrappedSample step_from_;
  MonoNs stretch_since_ = 0;
  double fastest_ = 0;
  double fastest_before_ = 0;
};

}  // namespace axlecast
