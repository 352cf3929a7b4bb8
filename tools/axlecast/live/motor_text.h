#pragma once

#include <axlecast/motor_health_t.hpp>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// How a monitored motor is shown to people.

// Length of the acceleration vector in m/s^2, gravity included; NaN when unknown.
[[nodiscard]] double AccelMagnitude(const motor_health_t& motor);

// "250.0 W 45.0 degC"
[[nodiscard]] std::string MotorValueText(const motor_health_t& motor);

// "230.1 V, 1.500 A, 250.0 W, 45.0 degC, 9.81 m/s2"
[[nodiscard]] std::string MotorQuantities(const motor_health_t& motor);

// "power upper A, stop commanded, logged in, 50 Hz mains": status, stop coil, login, mains. What is not known is left
// out; without a trip it begins with "no trip".
[[nodiscard]] std::string MotorStatusText(const motor_health_t& motor);

// What is left to each trip limit that is in force: "to trip: power upper A 180.0 W, overheat 45.0 degC". Empty when no limit
// is known.
[[nodiscard]] std::string MarginsText(const DeviceView& device);

// Each trip limit in a text of its own: "power upper A above 300.0 W: now 120.0 W, 180.0 W left". Empty before LIMITS came.
[[nodiscard]] std::vector<std::string> LimitTexts(const DeviceView& device);

// Heading and rows of the live table, each at most kTableWidth columns: quantities, status, and margins to the
// trip limits and alarms where there are any.
[[nodiscard]] std::string MotorHeading();
void AddMotorRows(const DeviceView& device, MonoNs now, std::vector<std::string>& lines);

}  // namespace axlecast
