#pragma once

#include <axlecast/motor_health_t.hpp>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

inline constexpr std::size_t kTableWidth = 80;

// Texts of devices: monitored motors, values, alarms and errors.

// "250.0 W 45.0 degC"
[[nodiscard]] std::string MotorValueText(const motor_health_t& motor);

// "230.1 V, 1.500 A, 250.0 W, 45.0 degC, 9.81 m/s2"
[[nodiscard]] std::string MotorQuantities(const motor_health_t& motor);

// "power upper A, stop commanded, logged in, 50 Hz mains": status, stop coil, login, mains. Unknown
// parts are omitted. Without a trip, it begins with "no trip".
[[nodiscard]] std::string MotorStatusText(const motor_health_t& motor);

// The margins to the trip limits in force, or an empty text: "to trip: power upper A 180.0 W, overheat 45.0 degC"
[[nodiscard]] std::string MarginsText(const DeviceView& device);

// One text per trip limit: "power upper A above 300.0 W: now 120.0 W, 180.0 W left". Empty if LIMITS was not received.
[[nodiscard]] std::vector<std::string> LimitTexts(const DeviceView& device);

// Heading and rows of the live table, at most kTableWidth columns wide: quantities, status, margins and alarms.
[[nodiscard]] std::string MotorHeading();
void AddMotorRows(const DeviceView& device, MonoNs now, std::vector<std::string>& lines);

// "12.5 mm": the last valid position, with the decimals of one count. "250.0 W 45.0 degC" for a monitor. "-" if unknown.
[[nodiscard]] std::string ValueText(const DeviceView& device);

// "battery_alarm", or "battery_alarm +2" if there are more, within `width`. Empty without an alarm.
[[nodiscard]] std::string AlarmText(const DeviceView& device, std::size_t width);

// Formats the present state in one line, so that an operator sees what a command would change.
[[nodiscard]] std::string PresentText(const DeviceView& device, MonoNs now);

// Returns the error for a device of which no message was received.
[[nodiscard]] std::string NoAnswer(const DeviceView& device);

// Returns the error for an unknown device, with the nearest name and all names.
[[nodiscard]] std::string UnknownDevice(const MachineConfig& machine, std::string_view name);

}  // namespace axlecast
