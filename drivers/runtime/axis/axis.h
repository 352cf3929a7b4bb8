#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/device/reading.h"
#include "drivers/runtime/axis/motion.h"

namespace axlecast {

// Converts counts (after direction and datum) to the angle of the shaft and to the unit of the axis, and back.
class Scale {
 public:
  explicit Scale(const DeviceConfig& device);

  [[nodiscard]] double AngleRad(std::int64_t counts) const;  // [0, 2 pi)
  // Returns counts x per_turn x num / (den x counts per turn), within [0, modulo) if a modulo is set. If the modulo is a
  // whole number of counts (of a geared axis: x den), the result is exact at any distance.
  [[nodiscard]] double Value(std::int64_t counts) const;
  // Returns the counts nearest to `value`, or nothing beyond 2^52.
  [[nodiscard]] std::optional<std::int64_t> Counts(double value) const;
  [[nodiscard]] double unit_per_count() const { return unit_per_count_; }
  // Returns false if one turn of the shaft is a whole number of `modulo`: the value then does not depend on the turns.
  [[nodiscard]] bool TurnsMatter() const;

 private:
  std::int64_t counts_per_turn_;
  std::int64_t ratio_num_;
  double unit_per_count_;
  double modulo_;
  double unit_per_shaft_turn_;
  // `modulo_` in counts x ratio_num_: the counts after which the value repeats; 0 if this is not a whole number.
  std::int64_t exact_period_ = 0;
};

// The datum of an axis: the counts (after direction) that read 0, when it was set, and whether it is lost.
class Reference {
 public:
  explicit Reference(const DeviceConfig& device);

  struct Datum {
    std::int64_t counts = 0;
    std::int64_t unix_us = 0;  // 0: from the file, or unknown

    friend bool operator==(const Datum&, const Datum&) = default;
  };

  // Sets the datum, which was established at `set_at`. A datum from before the loss of the reference does not restore
  // the reference. The same datum again changes nothing.
  void Set(const Datum& datum, MonoNs set_at, MonoNs now);
  // Returns true if a given timestamp is between `since` and `now`. 2 s are allowed for a `now` that lags. A timestamp
  // further in the future comes from a wrong clock.
  [[nodiscard]] static bool Within(MonoNs instant, MonoNs since, MonoNs now);

  void Lose(MonoNs now);
  void Restore() { lost_ = false; }
  // Increments the epoch: the counts changed without motion.
  void Jump() { ++epoch_; }
  // Deletes the datum that was set. The datum of the file, or none, is used again.
  void Clear();
  // As Clear, without a new epoch: the zero of the encoder was moved, and the datum counted from the old zero.
  void DropDatum();

  [[nodiscard]] std::int64_t datum() const { return datum_ ? datum_->counts : 0; }  // 0 without one
  [[nodiscard]] std::int64_t datum_unix_us() const { return datum_ ? datum_->unix_us : 0; }
  [[nodiscard]] bool has_datum() const { return datum_.has_value(); }
  [[nodiscard]] const std::optional<Datum>& of_file() const { return of_file_; }
  [[nodiscard]] bool lost() const { return lost_; }
  [[nodiscard]] std::int32_t epoch() const { return epoch_; }

 private:
  std::optional<Datum> of_file_;
  std::optional<Datum> datum_;
  std::int32_t epoch_ = 0;
  bool lost_ = false;
  MonoNs lost_at_ = 0;
};

// The position of the axis that follows from one sample.
struct AxisReading {
  enum class Kind : std::uint8_t {
    kGood,
    kDoubtful,  // decoded, but not usable: the flags contain the reason
    kWithheld,  // the first one: the next reading must agree with it
  };
  Kind kind = Kind::kWithheld;
  std::int32_t flags = 0;   // position_t FLAG_* that follow from the sample and the state of the axis
  std::int64_t counts = 0;  // after direction and datum; of a doubtful reading: what it would be
};

// Computes the positions of one shaft from the samples of its encoder. No clock, no I/O, no allocation.
//
// Counts: counts = direction x (unwrapped counts of the encoder) - datum. They never wrap.
// Flags:
//   VALID           plausible, and reported as valid by the device
//   TURNS_VALID     VALID, the whole turns are sure (TurnCounter), the reference is not lost, and the axis is
//                   within the ends that `turns: signed|unsigned` set; with `unsigned` also: the counter has not
//                   overflowed
//   TURNS_WRAPPED   the counter overflowed, or the axis is outside these ends
//   REFERENCED      a datum is set, the reference is not lost, and the turns are sure if the value depends on them
//   LOW_ACCURACY, DEVICE_ERROR, DEVICE_WARNING   reported by the device
//   IMPLAUSIBLE     further from the last good reading than the shaft can have moved
//   TURNS_COUNTED_BY_DRIVER   the turns of this reading follow from unwrapping
//   DATUM_CHANGING  between OnDatumChanging(true) and (false)
class Axis {
 public:
  explicit Axis(const DeviceConfig& device);

  [[nodiscard]] AxisReading Take(const Sample& sample);

  // Returns rad/s after direction, or NaN while the speed is unknown. Readings of reduced accuracy are not used.
  [[nodiscard]] double SpeedRadS() const;
  [[nodiscard]] Motion MotionAt(MonoNs now) const { return standstill_.At(now); }
  [[nodiscard]] const Scale& scale() const { return scale_; }
  [[nodiscard]] const Reference& reference() const { return reference_; }
  [[nodiscard]] bool outside() const { return outside_; }
  // Returns the counts (after direction and datum) of the last reading if that reading was good.
  [[nodiscard]] std::optional<std::int64_t> Counts() const;
  // Returns the last good reading since the start or the last announced jump: counts after direction, before the datum.
  [[nodiscard]] std::optional<UnwrappedSample> LastValid() const;
  // How often the counts changed without motion and without announcement.
  [[nodiscard]] std::int64_t unexplained_jumps() const { return unexplained_jumps_; }

  // See the functions of DevicePublisher with the same names.
  void SetDatum(const Reference::Datum& datum, MonoNs set_at, MonoNs now);
  void ClearDatum() { reference_.Clear(); }
  [[nodiscard]] std::optional<std::int64_t> DatumFor(double value) const;
  [[nodiscard]] std::optional<double> ValueWith(std::int64_t datum) const;
  void OnReferenceLost(MonoNs now) { reference_.Lose(now); }
  void OnReferenceRestored() { reference_.Restore(); }
  void OnJump();
  void OnDatumChanging(bool changing);

 private:
  [[nodiscard]] TurnCounter::Unwrapped Unwrap(const UnwrappedSample* by, const Sample& sample) const;
  [[nodiscard]] AxisReading TakeDoubtful(const Sample& sample);
  void Begin(const UnwrappedSample& first, const Sample& sample);
  void Continue(const TurnCounter::Unwrapped& unwrapped, const Sample& sample);
  void Settle(const UnwrappedSample& good, bool continuous);
  void CountJump(MonoNs now, bool loses_reference);
  [[nodiscard]] AxisReading Good(const Sample& sample);
  [[nodiscard]] AxisReading Bad(const Sample& sample, const UnwrappedSample& unwrapped, std::int32_t why);
  [[nodiscard]] std::int32_t StateFlags(const Sample& sample) const;
  [[nodiscard]] std::int64_t Absolute(std::int64_t counts) const { return sign_ * counts - reference_.datum(); }
  // Returns the datum in the encoder's own counts.
  [[nodiscard]] std::optional<std::int64_t> Origin() const;

  std::int64_t sign_;
  double rad_per_count_;
  Scale scale_;
  TurnCounter turns_;
  Plausibility plausibility_;
  Reference reference_;
  Speed speed_;
  Standstill standstill_;
  bool begun_ = false;         // a good reading came since the start or the last announced jump
  bool begins_sure_;           // turns that only the driver counts are known when the counting begins
  MonoNs counting_since_ = 0;  // begin of the present uninterrupted counting of turns
  bool settled_ = false;       // the last reading was good
  bool outside_ = false;
  bool datum_changing_ = false;
  std::int64_t unexplained_jumps_ = 0;
};

}  // namespace axlecast
