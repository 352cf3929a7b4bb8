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

// Returns the number congruent to `counts` that is nearest to `centre`: in [centre - modulus/2, centre + modulus/2).
[[nodiscard]] constexpr std::int64_t Nearest(std::int64_t counts, std::int64_t modulus, std::int64_t centre) {
  const std::int64_t ahead = FloorMod(counts - centre, modulus);
  return centre + (ahead < modulus - modulus / 2 ? ahead : ahead - modulus);
}

// A sample with its turns: counts that do not wrap, in the encoder's own direction and from its own zero.
struct UnwrappedSample {
  std::int64_t counts = 0;
  Interval at;                // contains the sampling time
  bool low_accuracy = false;  // the single-turn resolution was reduced
};

// How far a shaft can move: the limits of its configuration, or else those of the device's model.
//
// Every check allows for what is not known: the sampling times (anywhere within UnwrappedSample::at), the noise between
// two readings (DeviceSettings::noise_counts), the quantisation (1 count), and 1/32 turn for each reading of reduced
// accuracy (TS5669 spec 6.4, FS: 5 bits). A shaft within its limits is therefore never implausible.
class MotionLimits {
 public:
  MotionLimits() = default;
  // A limit of 0 means unlimited.
  MotionLimits(std::int64_t counts_per_turn, double speed_rpm, double accel_rad_s2, std::int64_t noise_counts);
  explicit MotionLimits(const DeviceConfig& device);

  // Returns the largest possible difference in counts between two readings.
  [[nodiscard]] double Reach(const UnwrappedSample& from, const UnwrappedSample& to) const;
  [[nodiscard]] bool SpeedAllows(const UnwrappedSample& from, const UnwrappedSample& to) const;

  // Returns true if a motion within the acceleration limit can pass through a, b and c, in this order, or if the
  // intervals of two of them overlap. The check is tightest if `a` is far from `c`: about the error of one reading.
  [[nodiscard]] bool AccelerationAllows(const UnwrappedSample& a, const UnwrappedSample& b,
                                        const UnwrappedSample& c) const;

 private:
  [[nodiscard]] double Error(const UnwrappedSample& a, const UnwrappedSample& b) const;

  double speed_ = 0;         // counts per ns
  double acceleration_ = 0;  // counts per ns^2
  double error_ = 1;         // counts, between two readings
  double low_accuracy_ = 0;  // counts, for each reading of reduced accuracy
};

// Unwraps the readings of an encoder, and determines whether their whole turns are sure.
//
// The readings of an encoder repeat after `range` turns (its multi-turn counter). They repeat after one turn if the
// encoder has no counter, if the reply does not contain the counter, or if the encoder reports that it may be wrong. The
// result is the value nearest to the last good reading. It is right if the shaft cannot have moved half the period since.
// Otherwise:
// - single-turn, mode modulo, or a multi-turn encoder without its counter: the turns are no longer sure;
// - mode signed or unsigned: the configured ends of the axis determine the turn.
// When the multi-turn counter is available again, it is used at once if it agrees with the counting, and otherwise after
// three equal contradictions.
class TurnCounter {
 public:
  struct Unwrapped {
    UnwrappedSample sample;
    bool by_counter = false;  // the encoder's own turns were used
    bool continuous = true;   // the distance from the sample before is known, whole turns included
  };
  // The effect of an accepted reading on the counting.
  struct Change {
    std::int64_t correction = 0;  // counts to add to this sample and all later ones: whole turns
    bool was_sure = false;        // the turns were sure before it
    bool lost_turns = false;      // they were, and only a new datum restores them
  };

  TurnCounter(const DeviceConfig& device, const MotionLimits& limits);

  // Unwraps the first reading. In mode modulo the result is nearest to `origin`, or without `origin` in [0, range).
  [[nodiscard]] UnwrappedSample First(const Sample& sample, std::optional<std::int64_t> origin) const;
  [[nodiscard]] Unwrapped Follow(const UnwrappedSample& from, const Sample& sample) const;
  // Begins the counting with `sample`. `sure`: turns that only the driver counts are known from here on.
  void Begin(const Sample& sample, bool sure);
  // Accepts `unwrapped`, which was made from `sample`, as good.
  [[nodiscard]] Change Accept(const Unwrapped& unwrapped, const Sample& sample);

  // Marks the turns as sure (a datum was set at the present turn) or as not sure (a datum is older than the counting).
  void Trust() { sure_ = true; }
  void Distrust();

  [[nodiscard]] bool sure() const { return sure_; }
  // Returns true if the turns of this accepted sample follow from unwrapping.
  [[nodiscard]] bool CountedByDriver(const Sample& sample) const;
  // Returns true if the counter overflowed, so that the turns are unknown.
  [[nodiscard]] bool Ambiguous(const Sample& sample) const {
    return has_counter() && mode_ == TurnsMode::kUnsigned && sample.turns_wrapped;
  }
  // Returns true beyond the ends of mode signed or unsigned: a restart would count from the other end.
  [[nodiscard]] bool Outside(std::int64_t counts) const;
  [[nodiscard]] bool has_counter() const { return turns_range_ > 1; }
  // Returns true if the turns are known by counting only.
  [[nodiscard]] bool OnlyCounted() const { return !has_counter() && mode_ == TurnsMode::kModulo; }
  // Returns the counts that First would give for the same place, or `counts` if the counting determines them.
  [[nodiscard]] std::int64_t NearOrigin(std::int64_t counts, std::int64_t origin) const;

 private:
  [[nodiscard]] bool HoldsTurns(const Sample& sample) const { return has_counter() && sample.has_turns; }
  // `period`: the counts after which the reading repeats; `whole`: this is the whole range of the encoder.
  [[nodiscard]] Unwrapped Nearer(const UnwrappedSample& from, const Sample& sample, std::int64_t period,
                                 bool whole) const;
  [[nodiscard]] std::int64_t CountsOf(const Sample& sample) const;
  [[nodiscard]] std::int64_t WithinEnds(std::int64_t counts, std::int64_t period) const;
  [[nodiscard]] std::int64_t Align(const Unwrapped& unwrapped, const Sample& sample);

  static constexpr int kContradictionsToAccept = 3;

  MotionLimits limits_;
  std::int64_t counts_per_turn_;
  std::int64_t turns_range_;
  std::int64_t period_;
  TurnsMode mode_;
  bool sure_ = false;               // the whole turns in the counts are known
  bool aligned_ = false;            // the encoder's counter agrees with the counting
  bool trusted_ = true;             // the encoder has not reported that its turns may be wrong
  std::int64_t contradiction_ = 0;  // counts
  int contradictions_ = 0;
};

// Compares readings with the last good one.
//
// - A reading is good if the shaft can have reached it from the last good reading, by speed and by acceleration. The
//   reachable range grows with time. The acceleration is checked against several earlier readings: the last two, and up
//   to three that are 1 ms or more apart. They contain the speed of the shaft. This also limits a reading that comes
//   only microseconds after the last good one.
// - Any other reading is doubtful. After `confirmations_after_jump` consecutive doubtful readings that agree with each
//   other (most devices: 3), the new position is accepted.
// - Without a last good reading, the first reading must be confirmed by a second one. This applies at the start, after an
//   announced jump, and if readings of reduced accuracy were further off than their 5 bits.
class Plausibility {
 public:
  enum class Doubt : std::uint8_t {
    kFirst,              // there is no reading to compare with
    kImplausible,        // the shaft cannot have reached it
    kAcceptedAtStart,    // accepted: the second of two that agree at the start
    kAcceptedAfterJump,  // accepted: enough readings agree; the position of the encoder jumped
    kPreviousWasWrong,   // accepted: the readings before the last good one agree; only the last good one was wrong
  };

  // `confirmations_after_jump`: see DeviceSettings; at least 2.
  explicit Plausibility(const MotionLimits& limits, int confirmations_after_jump = 3)
      : limits_(limits), confirmations_(confirmations_after_jump) {}

  // Returns the last good reading, from which the next one is unwrapped, or null.
  [[nodiscard]] const UnwrappedSample* Last() const { return known_ ? &last_ : nullptr; }
  // Returns the previous doubtful reading, from which a doubtful one is unwrapped, or null.
  [[nodiscard]] const UnwrappedSample* Doubted() const { return run_ > 0 ? &doubted_ : nullptr; }

  // Returns true if the shaft can have moved from the last good reading, which must exist, to `sample`.
  [[nodiscard]] bool Agrees(const UnwrappedSample& sample) const;
  // Accepts `sample` as good. `continuous`: its distance from the last good one is known, whole turns included.
  void Accept(const UnwrappedSample& sample, bool continuous);
  // Takes a reading that does not agree, or that has no last good reading to agree with.
  [[nodiscard]] Doubt TakeDoubtful(const UnwrappedSample& sample);

  // While `hold` is true (during an announced jump), doubtful readings are not accepted.
  void Hold(bool hold);
  // Makes the next reading a first one.
  void Forget();
  // Adds `counts` to the stored readings: the same place is counted differently from now on.
  void Shift(std::int64_t counts);

 private:
  [[nodiscard]] bool AccelerationAllows(const UnwrappedSample& sample) const;
  void PushAnchor(const UnwrappedSample& sample);

  static constexpr int kRunToBegin = 2;

  MotionLimits limits_;
  int confirmations_;
  bool known_ = false;
  bool hold_ = false;
  bool has_before_ = false;
  UnwrappedSample last_;
  UnwrappedSample before_;                    // the good reading before the last
  std::array<UnwrappedSample, 3> anchors_{};  // good readings at least 1 ms apart, newest first
  std::size_t anchor_count_ = 0;
  int run_ = 0;              // consecutive doubtful readings that agree with each other
  UnwrappedSample doubted_;  // the last of them
};

// The speed of the shaft: the slope of the line that fits the good readings of the last 8 ms best (readings 0.5 ms or
// more apart, up to 16). With slower readings, the line covers up to 20 ms. If their sampling times are too uncertain,
// it covers up to 0.5 s. The result is the speed of about half the covered time ago.
class Speed {
 public:
  void Add(const UnwrappedSample& sample);
  void Forget() { size_ = 0; }
  // Returns counts per second, or NaN while it is unknown: fewer than two readings, less than 1 ms between them, or
  // sampling times that are uncertain by more than a quarter of the covered time.
  [[nodiscard]] double CountsPerSecond() const;

 private:
  static constexpr std::size_t kSize = 16;
  static constexpr MonoNs kSpacing = 500 * kMicrosecond;
  static constexpr MonoNs kWindow = 20 * kMillisecond;
  static constexpr MonoNs kLongest = 500 * kMillisecond;
  static constexpr MonoNs kShortest = kMillisecond;

  [[nodiscard]] const UnwrappedSample& Back(std::size_t i) const { return ring_[(newest_ + kSize - i) % kSize]; }
  // Returns true if the last `used` readings give a speed.
  [[nodiscard]] bool Known(std::size_t used) const;
  [[nodiscard]] std::size_t Used() const;

  std::array<UnwrappedSample, kSize> ring_{};
  std::size_t newest_ = 0;
  std::size_t size_ = 0;
  UnwrappedSample last_;
};

// Detects from the good readings whether the shaft stands still.
//
// Standstill requires at least two readings that cover 40 ms or more, the last at most 120 ms old, all within the
// tolerance of each other. The tolerance is 0.1 degrees, at least 2 counts, plus twice the noise of the encoder. The ten
// requests of a reset sequence, 40 ms apart, are enough to continue a standstill.
//
// If a whole turn fits between two readings (`continuous` is false), they can continue a standstill, but not begin one: a
// shaft at 1,500 min-1 is at the same angle every 40 ms.
class Standstill {
 public:
  Standstill(std::int64_t counts_per_turn, std::int64_t noise_counts);

  void Add(const UnwrappedSample& sample, bool continuous);
  // Restarts the detection: the same place is counted differently from now on.
  void Forget() { any_ = false; }
  [[nodiscard]] Motion At(MonoNs now) const;

  static constexpr MonoNs kCover = 40 * kMillisecond;
  static constexpr MonoNs kOldest = 120 * kMillisecond;

 private:
  void BeginWatch(const UnwrappedSample& sample);
  void BeginWindow(const UnwrappedSample& sample);
  void Extend(const UnwrappedSample& sample, bool continuous);
  void MeasureSpeed(const UnwrappedSample& sample);

  std::int64_t counts_per_turn_;
  std::int64_t tolerance_;
  bool any_ = false;
  UnwrappedSample last_;
  MonoNs watched_since_ = 0;  // begin of the present readings without a long gap
  // The present window: every reading since `since_` is within [lowest_, highest_].
  MonoNs since_ = 0;
  std::int64_t lowest_ = 0;
  std::int64_t highest_ = 0;
  bool established_ = false;  // readings that exclude whole turns between them covered kCover
  bool moved_ = false;        // a window ended because the shaft moved
  // Largest speed in counts per ns over steps of 5 ms or more, in the present and in the last interval of kCover.
  UnwrappedSample step_from_;
  MonoNs interval_since_ = 0;
  double fastest_ = 0;
  double fastest_before_ = 0;
};

}  // namespace axlecast
