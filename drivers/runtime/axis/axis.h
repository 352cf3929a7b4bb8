#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/device/reading.h"
#include "drivers/runtime/axis/motion.h"

namespace axlecast {

// From counts (after direction and datum) to the shaft's angle and to the user's unit, and back.
class Scale {
 public:
  explicit Scale(const DeviceConfig& device);

  [[nodiscard]] double AngleRad(std::int64_t counts) const;  // [0, 2 pi)
  // counts x per_turn x num / (den x counts per turn), within [0, modulo) where there is one. With a modulo that is
  // a whole number of counts (of a geared axis: x den) it is exact however far the axis has gone.
  [[nodiscard]] double Value(std::int64_t counts) const;
  // The counts that read `value`, to the nearest; nothing beyond 2^52.
  [[nodiscard]] std::optional<std::int64_t> Counts(double value) const;
  [[nodiscard]] double unit_per_count() const { return unit_per_count_; }
  // False where each whole turn of the shaft is a whole number of `modulo`: the value is right without them.
  [[nodiscard]] bool TurnsMatter() const;

 private:
  std::int64_t counts_per_turn_;
  std::int64_t ratio_num_;
  double unit_per_count_;
  double modulo_;
  double unit_per_shaft_turn_;
  // `modulo_` in counts x ratio_num_, and the counts after which the value repeats; 0 where it is no whole number.
  std::int64_t exact_period_ = 0;
};

// The datum of an axis: the counts (after direction) that read 0, since when, and whether it may be trusted.
class Reference {
 public:
  explicit Reference(const DeviceConfig& device);

  struct Datum {
    std::int64_t counts = 0;
    std::int64_t utime = 0;  // 0: from the file, or unknown

    friend bool operator==(const Datum&, const Datum&) = default;
  };

  // A datum, established at the instant `set_at`. One that was established before the reference was lost does not
  // bring it back. The same datum again changes nothing.
  void Set(const Datum& datum, MonoNs set_at, MonoNs now);
  // Whether an instant that was given lies between `since` and `now`, allowing 2 s for a `now` that lags: a stamp
  // from the future comes from a wrong clock.
  [[nodiscard]] static bool Within(MonoNs instant, MonoNs since, MonoNs now);

  void Lose(MonoNs now);
  void Restore() { lost_ = false; }
  // Counts changed without motion.
  void Jump() { ++epoch_; }
  // The datum that was set goes: the file's, or none, is in force.
  void Clear();
  // The encoder's own zero was moved: a datum counted from the old one means nothing any more.
  void DropDatum();

  [[nodiscard]] std::int64_t datum() const { return datum_ ? datum_->counts : 0; }  // 0 without one
  [[nodiscard]] std::int64_t utime() const { return datum_ ? datum_->utime : 0; }
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

// A sample as a position of the axis.
struct AxisReading {
  enum class Kind : std::uint8_t {
    kGood,
    kDoubtful,  // decoded, but not to be used: the flags say why
    kWithheld,  // the first one: waits for a second that agrees
  };
  Kind kind = Kind::kWithheld;
  std::int32_t flags = 0;   // position_t FLAG_*: those that follow from the sample and the axis's state
  std::int64_t counts = 0;  // after direction and datum; of a doubtful reading: as it would be
};

// One shaft: samples of its encoder become positions. Pure: no clock, no I/O, no allocation.
//
// Counts: counts = direction x (unwrapped counts of the encoder) - datum. They never wrap.
// Flags:
//   VALID           good, and the device calls it valid
//   TURNS_VALID     VALID, the whole turns are sure (TurnCounter), the reference is not lost, and the axis is
//                   within the ends that `turns: signed|unsigned` set; with `unsigned` also: the counter never
//                   overflowed
//   TURNS_WRAPPED   the counter overflowed, or the axis is outside these ends
//   REFERENCED      a datum is set, the reference is not lost, and the turns are as sure as the value needs them
//   LOW_ACCURACY, DEVICE_ERROR, DEVICE_WARNING   as the device says
//   IMPLAUSIBLE     out of reach from the last good reading
//   TURNS_COUNTED_BY_DRIVER   the turns of this reading follow from unwrapping
//   DATUM_CHANGING  between OnDatumChanging(true) and (false)
class Axis {
 public:
  explicit Axis(const DeviceConfig& device);

  [[nodiscard]] AxisReading Take(const Sample& sample);

  // Rad per second after direction; NaN while unknown: readings of reduced accuracy tell no speed.
  [[nodiscard]] double SpeedRadS() const;
  [[nodiscard]] Motion MotionAt(MonoNs now) const { return standstill_.At(now); }
  [[nodiscard]] const Scale& scale() const { return scale_; }
  [[nodiscard]] const Reference& reference() const { return reference_; }
  [[nodiscard]] bool outside() const { return outside_; }
  // Counts after direction and datum of the last good reading; nothing before the first, or after a doubtful one.
  [[nodiscard]] std::optional<std::int64_t> Counts() const;
  // The last good reading since the start or the last announced jump: counts after direction, before the datum.
  [[nodiscard]] std::optional<UnwrappedSample> LastValid() const;
  // Times that the counts changed without motion and without announcement.
  [[nodiscard]] std::int64_t unexplained_jumps() const { return surprises_; }

  // As DevicePublisher's of the same names.
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
  void Begin(const UnwrappedSample& fix, const Sample& sample);
  void Continue(const TurnCounter::Unwrapped& unwrapped, const Sample& sample);
  void Settle(const UnwrappedSample& fix, bool continuous);
  void Surprise(MonoNs now, bool loses_reference);
  [[nodiscard]] AxisReading Good(const Sample& sample);
  [[nodiscard]] AxisReading Bad(const Sample& sample, const UnwrappedSample& fix, std::int32_t why);
  [[nodiscard]] std::int32_t StateFlags(const Sample& sample) const;
  [[nodiscard]] std::int64_t Absolute(std::int64_t counts) const { return sign_ * counts - reference_.datum(); }
  // Where the datum is, in the encoder's own counts.
  [[nodiscard]] std::optional<std::int64_t> Origin() const;

  std::int64_t sign_;
  double rad_per_count_;
  Scale scale_;
  TurnCounter turns_;
  Plausibility plausibility_;
  Reference reference_;
  Speed speed_;
  Standstill standstill_;
  bool begun_ = false;         // there has been a good reading since the start or the last announced jump
  bool begins_sure_;           // turns that only the driver counts are right when the counting begins
  MonoNs counting_since_ = 0;  // turns have been counted without a break since
  bool settled_ = false;       // the last reading was good
  bool outside_ = false;
  bool datum_changing_ = false;
  std::int64_t surprises_ = 0;
};

}  // namespace axlecast
