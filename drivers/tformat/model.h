#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "drivers/tformat/codec.h"

namespace axlecast::tformat {

// What the driver must know of an encoder on T-format.
struct Model {
  std::string_view name;  // as in the configuration
  Format format;
  std::uint8_t encoder_id = 0;  // ENID: names the model, not the unit
  double max_speed_rpm = 0;
  double max_accel_rad_s2 = 0;
};

// Every model but `custom`, whose bits and ENID come from the configuration.
[[nodiscard]] std::span<const Model> Models();
[[nodiscard]] const Model* FindModel(std::string_view name);

inline constexpr std::string_view kCustomModel = "custom";

// Largest difference of two readings of the same place: the adjoining pitch error is +-40 arc-sec, 4 counts of 2^17
// (TS5669 spec 5.4.1). Taken as the same angle for every model.
[[nodiscard]] std::int64_t NoiseCounts(int single_turn_bits);

// A stationary shaft is reset to 0 +- 0.35 degrees (TS5669 spec 9).
inline constexpr double kZeroToleranceDeg = 0.35;
[[nodiscard]] std::int64_t ZeroToleranceCounts(int single_turn_bits);

}  // namespace axlecast::tformat
