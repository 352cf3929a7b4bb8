#pragma once

#include <cstdint>

#include "core/config/machine_config.h"
#include "drivers/runtime/axis/unwrapped_sample.h"

namespace axlecast {

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

}  // namespace axlecast
