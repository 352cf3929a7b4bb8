#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/runtime/axis/motion_limits.h"
#include "drivers/runtime/axis/unwrapped_sample.h"

namespace axlecast {

// Judges readings against the last good one.
//
// - A reading within reach of the last good one, by speed and by acceleration, is good. Reach grows with time:
//   after a gap any place is good that the shaft can have come to. By acceleration it is judged against several earlier
//   readings: the last two, and up to three that are 1 ms or more apart. They tell how fast the shaft turns, and so where
//   it can be now, also when the last good reading is only microseconds old.
// - Another one is doubtful. So many doubtful ones in a row as the device needs, three of most, that agree among each
//   other become the new truth.
// - Without a last good reading (at the start, after an announced jump, or when readings of reduced accuracy turn
//   out to have been further off than their 5 bits) the first reading waits for a second one that agrees.
class Plausibility {
 public:
  enum class Doubt : std::uint8_t {
    kFirst,              // nothing to compare with yet
    kImplausible,        // out of reach
    kAcceptedAtStart,    // the second of two that agree at the start: accepted
    kAcceptedAfterJump,  // the last of those that it takes: accepted; what the encoder says jumped
    kPreviousWasWrong,   // likewise, but those before the last good one agree with it: the last good one was wrong
  };

  // `confirmations_after_jump`: as DeviceSettings has it, at least 2.
  explicit Plausibility(const MotionLimits& limits, int confirmations_after_jump = 3)
      : limits_(limits), run_to_overthrow_(confirmations_after_jump) {}

  // The reading by way of which the next one is to be unwrapped: the last good one; null when there is none.
  [[nodiscard]] const UnwrappedSample* Last() const { return known_ ? &last_ : nullptr; }
  // The doubtful one before, by way of which a doubtful one is to be unwrapped; null when there is none.
  [[nodiscard]] const UnwrappedSample* Doubted() const { return run_ > 0 ? &doubted_ : nullptr; }

  // Whether `fix` is within reach of the last good reading. There is one.
  [[nodiscard]] bool Agrees(const UnwrappedSample& fix) const;
  // `fix` is good. `continuous`: its distance from the last good one is known, whole turns included.
  void Accept(const UnwrappedSample& fix, bool continuous);
  // `fix` is not within reach, or there is no last good reading.
  [[nodiscard]] Doubt TakeDoubtful(const UnwrappedSample& fix);

  // While an announced jump is under way doubtful readings do not become the truth.
  void Hold(bool hold);
  // The next reading is a first one.
  void Forget();
  // Counts are `counts` more for the same place from now on.
  void Shift(std::int64_t counts);

 private:
  [[nodiscard]] bool AccelerationAllows(const UnwrappedSample& fix) const;
  void PushAnchor(const UnwrappedSample& fix);

  static constexpr int kRunToBegin = 2;

  MotionLimits limits_;
  int run_to_overthrow_;
  bool known_ = false;
  bool hold_ = false;
  bool has_before_ = false;
  UnwrappedSample last_;
  UnwrappedSample before_;                    // the good reading before the last
  std::array<UnwrappedSample, 3> anchors_{};  // good readings at least 1 ms apart, newest first
  std::size_t anchor_count_ = 0;
  int run_ = 0;              // doubtful readings that agree among each other
  UnwrappedSample doubted_;  // the last of them
};

}  // namespace axlecast
