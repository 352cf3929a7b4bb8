#include "tools/monitor/trip_margins.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/messages/json/field.h"

namespace axlecast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

enum class Trips : std::uint8_t { kAbove, kBelow };

TripMargin Margin(std::int32_t status_bit, std::string_view name, std::string_view unit, double measured,
                  double limit, Trips trips) {
  const double left = trips == Trips::kAbove ? limit - measured : measured - limit;
  return {status_bit, name, unit, measured, limit, limit > 0 ? left : kUnknown};
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
  const auto number = [](float limit) { return static_cast<double>(limit); };
  return {Margin(motor_health_t::STATUS_POWER_UPPER_A, "power_upper_a", "W", power, number(limits.power_upper_w[0]),
                 Trips::kAbove),
          Margin(motor_health_t::STATUS_POWER_UPPER_B, "power_upper_b", "W", power, number(limits.power_upper_w[1]),
                 Trips::kAbove),
          Margin(motor_health_t::STATUS_POWER_LOWER_A, "power_lower_a", "W", power, number(limits.power_lower_w[0]),
                 Trips::kBelow),
          Margin(motor_health_t::STATUS_POWER_LOWER_B, "power_lower_b", "W", power, number(limits.power_lower_w[1]),
                 Trips::kBelow),
          Margin(motor_health_t::STATUS_OVERHEAT, "overheat", "°C", temperature, number(limits.overheat_c),
                 Trips::kAbove),
          Margin(motor_health_t::STATUS_EXCESSIVE_SHOCK, "excessive_shock", "m/s²", shock,
                 number(limits.shock_mps2), Trips::kAbove)};
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
