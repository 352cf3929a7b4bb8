#pragma once

#include <array>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

namespace axlecast {

// One limit that trips a monitored motor, beside the reading that it is compared with.
struct TripMargin {
  std::int32_t status_bit = 0;  // motor_health_t STATUS_* of such a trip
  std::string_view name;        // of that bit, as in JSON: "power_upper_a"
  std::string_view unit;
  double measured = 0;  // NaN: not known
  double limit = 0;     // 0: never trips; NaN: not read yet
  // What is left until the motor trips, below 0 beyond the limit. NaN for a limit that never trips, and where the reading
  // or the limit is not known.
  double margin = 0;
};

// Returns the margins to the four limits of power, to overheat and to shock, in the order of the status bits. Shock is
// that of the largest axis, in either direction, gravity included, as the unit compares it.
[[nodiscard]] std::array<TripMargin, 6> TripMargins(const motor_health_t& motor, const motor_limits_t& limits);

// [{"name", "unit", "measured", "limit", "margin"}, ...]; what is not known is null.
[[nodiscard]] nlohmann::ordered_json MarginsJson(std::span<const TripMargin> margins);

}  // namespace axlecast
