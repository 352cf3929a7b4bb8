#pragma once

#include <cstdint>
#include <optional>

#include "core/config/machine_config.h"

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

}  // namespace axlecast
