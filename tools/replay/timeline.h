#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Which instant of the clock a recording's time falls on. Every instant is reckoned from one anchor, so that rounding
// and late wake-ups do not add up.
class Timeline {
 public:
  // 0: as fast as possible, everything is due at once.
  explicit Timeline(double speed) : speed_(speed) {}

  // From now on `utime` falls on `now`.
  void Anchor(MonoNs now, std::int64_t utime);
  // What comes next bears `to` where its predecessor bore `from`: the recording's clock was set, or begins anew. `to`
  // falls where `from` does.
  void Splice(std::int64_t from, std::int64_t to);

  void Pause(MonoNs now);
  void Resume(MonoNs now);
  void SetSpeed(double speed, MonoNs now);

  // When `utime` is due; kNever while paused.
  [[nodiscard]] MonoNs Due(std::int64_t utime) const { return paused_ ? kNever : Instant(utime); }
  // The recording's time that falls on `now`; while paused, or as fast as possible, that of the anchor.
  [[nodiscard]] std::int64_t Utime(MonoNs now) const;

  [[nodiscard]] bool paused() const { return paused_; }
  [[nodiscard]] double speed() const { return speed_; }

 private:
  [[nodiscard]] MonoNs Instant(std::int64_t utime) const;

  double speed_;
  bool paused_ = false;
  MonoNs anchor_ = 0;
  std::int64_t anchor_utime_ = 0;
};

}  // namespace axlecast
