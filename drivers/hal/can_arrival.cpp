#include "drivers/hal/can_arrival.h"

#include <algorithm>

namespace axlecast {
namespace {

// A wider reading of the two clocks was interrupted; it is tried again a few times.
constexpr MonoNs kNarrow = 5 * kMicrosecond;
constexpr int kTries = 4;

}  // namespace

CanArrival::Offset CanArrival::Read() const {
  Offset best;
  for (int i = 0; i < kTries; ++i) {
    const MonoNs first = clock_.Now();
    const std::int64_t unix_us = clock_.UtcMicroseconds();  // rounded down
    const MonoNs last = clock_.Now();
    const Offset offset{.minimum = unix_us * kMicrosecond - last,
                        .maximum = unix_us * kMicrosecond + kMicrosecond - first,
                        .now = last};
    if (i == 0 || offset.maximum - offset.minimum < best.maximum - best.minimum) best = offset;
    best.now = last;
    if (best.maximum - best.minimum <= kNarrow) break;
  }
  return best;
}

void CanArrival::Start() {
  before_ = Read();
  floor_ = empty_ = before_.now;
}

Interval CanArrival::At(std::optional<std::int64_t> stamp) {
  const Offset offset = Read();
  const bool stepped = offset.minimum > before_.maximum || offset.maximum < before_.minimum;
  before_ = offset;
  const Interval unstamped{std::max(floor_, empty_), offset.now};
  if (!stamp || stepped) return unstamped;
  const Interval at{*stamp - offset.maximum, *stamp - offset.minimum};
  // What lies outside altogether was stamped by a clock that was stepped since, and back.
  if (at.last < floor_ || at.first > offset.now) return unstamped;
  floor_ = std::max(at.first, floor_);
  return {floor_, std::min(at.last, offset.now)};
}

}  // namespace axlecast
