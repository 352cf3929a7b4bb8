#pragma once

#include <cstdint>
#include <optional>

#include "core/config/machine_config.h"
#include "core/device/reading.h"
#include "drivers/runtime/axis/motion_limits.h"
#include "drivers/runtime/axis/unwrapped_sample.h"

namespace axlecast {

// Turns what an encoder says into unwrapped counts, and knows how far their whole turns may be trusted.
//
// The encoder repeats itself after `range` turns (its multi-turn counter), or after one turn where it has no
// counter, where a reply does not hold it, or where the encoder says that it may be wrong. The reading nearest to
// the last good one is taken: right as long as the shaft cannot have gone half that way since. Otherwise:
// - one turn, mode modulo, or a multi-turn encoder without its counter: the turns are not sure any more;
// - mode signed or unsigned: the user has said where the axis ends, and the reading within these ends is taken.
// A multi-turn counter that comes back is believed at once where it agrees with the counting, and after three equal
// contradictions where it does not.
class TurnCounter {
 public:
  struct Unwrapped {
    UnwrappedSample fix;
    bool by_counter = false;  // the encoder's own turns were used
    bool continuous = true;   // the distance from the fix before is known, whole turns included
  };
  // What accepting a reading did to the counting.
  struct Change {
    std::int64_t correction = 0;  // counts to add to this fix and the ones after it: whole turns
    bool was_sure = false;        // the turns were sure before it
    bool lost_turns = false;      // they were, and nothing but a datum brings them back
  };

  TurnCounter(const DeviceConfig& device, const MotionLimits& limits);

  // The first reading. In mode modulo the one nearest to `origin` is taken, without it [0, range).
  [[nodiscard]] UnwrappedSample First(const Sample& sample, std::optional<std::int64_t> origin) const;
  [[nodiscard]] Unwrapped Follow(const UnwrappedSample& from, const Sample& sample) const;
  // The counting begins with `sample`. `sure`: turns that only the driver counts are right from here on.
  void Begin(const Sample& sample, bool sure);
  // `unwrapped`, of `sample`, is good.
  [[nodiscard]] Change Accept(const Unwrapped& unwrapped, const Sample& sample);

  // A datum was set at the present turn, or restored from a time before the counting began.
  void Trust() { sure_ = true; }
  void Distrust();

  [[nodiscard]] bool sure() const { return sure_; }
  // The turns of this accepted sample follow from unwrapping.
  [[nodiscard]] bool CountedByDriver(const Sample& sample) const;
  // The counter overflowed, and that leaves the turns open.
  [[nodiscard]] bool Ambiguous(const Sample& sample) const {
    return has_counter() && mode_ == TurnsMode::kUnsigned && sample.turns_wrapped;
  }
  // Beyond the end that the mode signed or unsigned sets: a restart would count from the other end.
  [[nodiscard]] bool Outside(std::int64_t counts) const;
  [[nodiscard]] bool has_counter() const { return turns_range_ > 1; }
  // Nothing but counting tells the turns.
  [[nodiscard]] bool OnlyCounted() const { return !has_counter() && mode_ == TurnsMode::kModulo; }
  // The same place as `counts`, as First would count it; `counts` where the counting has more to say.
  [[nodiscard]] std::int64_t NearOrigin(std::int64_t counts, std::int64_t origin) const;

 private:
  [[nodiscard]] bool HoldsTurns(const Sample& sample) const { return has_counter() && sample.has_turns; }
  // `period`: after which the reading repeats itself; `whole`: that is all that the encoder knows.
  [[nodiscard]] Unwrapped Nearer(const UnwrappedSample& from, const Sample& sample, std::int64_t period,
                                 bool whole) const;
  [[nodiscard]] std::int64_t Said(const Sample& sample) const;
  [[nodiscard]] std::int64_t WithinEnds(std::int64_t said, std::int64_t period) const;
  [[nodiscard]] std::int64_t Align(const Unwrapped& unwrapped, const Sample& sample);

  static constexpr int kContradictionsToBelieve = 3;

  MotionLimits limits_;
  std::int64_t counts_per_turn_;
  std::int64_t turns_range_;
  std::int64_t period_;
  TurnsMode mode_;
  bool sure_ = false;               // the whole turns in the counts are right
  bool aligned_ = false;            // the encoder's counter agrees with the counting
  bool believed_ = true;            // the encoder did not say that its turns may be wrong
  std::int64_t contradiction_ = 0;  // counts
  int contradictions_ = 0;
};

}  // namespace axlecast
