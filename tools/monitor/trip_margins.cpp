#include "tools/monitor/trip_margins.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/messages/json/field.h"

namespace axlecast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

TripMargin Above(std::int32_t status_bit, std::string_view name, std::string_view unit, double measured,
                 double limit) {
  return {status_bit, name, unit, measured, limit, limit > 0 ? limit - measured : kUnknown};
}

TripMargin Below(std::int32_t status_bit, std::string_view name, double measured, double limit) {
  return {status_bit, name, "W", measured, limit, limit > 0 ? measured - limit : kUnknown};
}

// NaN if one axis is not known: another may be the largest.
double LargestAxis(const motor_health_t& motor) {
  double largest = 0;
  for (const float axis : motor.accel_mps2) {
    if (!std::isfinite(axis)) return kUnknown;
    largest = std::max(largest, std::abs(static_cast<double>(axis)));
  }
  return largest;
}

}  // namespace

std::array<TripMargin, 6> TripMargins(const motor_health_t& motor, const motor_limits_t& limits) {
  const bool known = (motor.flags & motor_health_t::FLAG_ANALOG_VALID) != 0;
  const double power = known ? static_cast<double>(motor.power_w) : kUnknown;
  const double temperature = known ? static_cast<double>(motor.temperature_c) : kUnknown;
  const double shock = known ? LargestAxis(motor) : kUnknown;
  using M = motor_health_t;
  const auto [upper_a, upper_b] = std::pair<double, double>(limits.power_upper_w[0], limits.power_upper_w[1]);
  const auto [lower_a, lower_b] = std::pair<double, double>(limits.power_lower_w[0], limits.power_lower_w[1]);
  return {
      Above(M::STATUS_POWER_UPPER_A, "power_upper_a", "W", power, upper_a),
      Above(M::STATUS_POWER_UPPER_B, "power_upper_b", "W", power, upper_b),
      Below(M::STATUS_POWER_LOWER_A, "power_lower_a", power, lower_a),
      Below(M::STATUS_POWER_LOWER_B, "power_lower_b", power, lower_b),
      Above(M::STATUS_OVERHEAT, "overheat", "°C", temperature, static_cast<double>(limits.overheat_c)),
      Above(M::STATUS_EXCESSIVE_SHOCK, "excessive_shock", "m/s²", shock, static_cast<double>(limits.shock_mps2))};
}

nlohmann::ordered_json MarginsJson(std::span<const TripMargin> margins) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const TripMargin& margin : margins) {
    json.push_back({{"name", margin.name},
                    {"unit", margin.unit},
                    {"measured", Field(margin.measured)},
                    {"limit", Field(margin.limit)},
                    {"margin", Field(margin.margin)}});
  }
  return json;
}

}  // namespace axlecast
