#pragma once

#include <cstdint>
#include <optional>

#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/device/reading.h"
#include "drivers/runtime/axis/plausibility.h"
#include "drivers/runtime/axis/reference.h"
#include "drivers/runtime/axis/scale.h"
#include "drivers/runtime/axis/speed.h"
#include "drivers/runtime/axis/standstill.h"
#include "drivers/runtime/axis/turn_counter.h"
#include "drivers/runtime/axis/unwrapped_sample.h"

namespace axlecast {

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
