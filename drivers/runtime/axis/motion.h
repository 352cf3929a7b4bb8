#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/device/reading.h"

namespace axlecast {

// Remainder in [0, modulus), also of negative numbers. Without a division where `counts` is near.
[[nodiscard]] constexpr std::int64_t FloorMod(std::int64_t counts, std::int64_t modulus) {
  if (counts >= 0 && counts < modulus) return counts;
  if (counts < 0 && counts >= -modulus) return counts + modulus;
  const std::int64_t rest = counts % modulus;
  return rest < 0 ? rest + modulus : rest;
}

// The number congruent to `counts` that is nearest to `around`: in [around - modulus/2, around + modulus/2).
[[nodiscard]] constexpr std::int64_t Nearest(std::int64_t counts, std::int64_t modulus, std::int64_t around) {
  const std::int64_t ahead = FloorMod(counts - around, modulus);
  return around + (ahead < modulus - modulus / 2 ? ahead : ahead - modulus);
}

// Where the shaft was: unwrapped counts in the encoder's own direction and from its own zero.
struct UnwrappedSample {
  std::int64_t counts = 0;
  Interval at;                // holds the sampling instant
  bool low_accuracy = false;  // the single-turn resolution was reduced
};

// How far a shaft can get: the limits of its configuration, or of the device's model where it names none.
//
// Every judgement is generous by what is not known: the sampling instants (anywhere within UnwrappedSample::at), the noise
// between two readings (DeviceSettings::noise_counts), the quantisation (1 count), and 1/32 turn for each reading
// of reduced accuracy (TS5669 spec 6.4, FS: 5 bits). So a shaft within its limits is never called implausible.
class MotionLimits {
 public:
  MotionLimits() = default;
  // A limit of 0 is none.
  MotionLimits(std::int64_t counts_per_turn, double speed_rpm, double accel_rad_s2, std::int64_t noise_counts);
  explicit MotionLimits(const DeviceConfig& device);

  // Largest distance in counts that two readings can show.
  [[nodiscard]] double Reach(const UnwrappedSample& from, const UnwrappedSample& to) const;
  [[nodiscard]] bool SpeedAllows(const UnwrappedSample& from, const UnwrappedSample& to) const;

  // Whether one motion within the acceleration limit passes through all three, a before b before c. Holds for stretches
  // of any length: within 51 us a single count of 17 bits is 18,400 rad/s2, but the noise of both readings allows far
  // more. The tightest judgement of a near c comes from a far a: about the error of one reading. True where the intervals
  // of two of them overlap.
  [[nodiscard]] bool AccelerationAllows(const UnwrappedSample& a, const UnwrappedSample& b,
                                        const UnwrappedSample& c) const;

 private:
  [[nodiscard]] double Error(const UnwrappedSample& a, const UnwrappedSample& b) const;

  double speed_ = 0;         // counts per ns
  double acceleration_ = 0;  // counts per ns^2
  double error_ = 1;         // counts, between two readings
  double low_accuracy_ = 0;  // counts, for each reading of reduced accuracy
};

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

// The shaft's speed from its last good readings: the slope of the straight line that fits those of the last 8 ms
// best (readings 0.5 ms or more apart, up to 16). From slower readings up to 20 ms, or as far back as it takes until
// their instants are known well enough, at most 0.5 s. So it is the speed of about half that time ago.
class Speed {
 public:
  void Add(const UnwrappedSample& fix);
  void Forget() { size_ = 0; }
  // Counts per second; NaN while it cannot be told: fewer than two readings, less than 1 ms between them, or
  // instants known to worse than a quarter of the time they span.
  [[nodiscard]] double CountsPerSecond() const;

 private:
  static constexpr std::size_t kSize = 16;
  static constexpr MonoNs kSpacing = 500 * kMicrosecond;
  static constexpr MonoNs kWindow = 20 * kMillisecond;
  static constexpr MonoNs kLongest = 500 * kMillisecond;
  static constexpr MonoNs kShortest = kMillisecond;

  [[nodiscard]] const UnwrappedSample& Back(std::size_t i) const { return ring_[(newest_ + kSize - i) % kSize]; }
  // The last `used` readings tell a speed.
  [[nodiscard]] bool Known(std::size_t used) const;
  [[nodiscard]] std::size_t Used() const;

  std::array<UnwrappedSample, kSize> ring_{};
  std::size_t newest_ = 0;
  std::size_t size_ = 0;
  UnwrappedSample last_;
};

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
