#pragma once

#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <axlecast/time_quality_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "tools/fleet/rows.h"

namespace axlecast {

// Rows of single messages. `name`: the rest of the channel's name.

// Returns the text as PostgreSQL accepts it: U+FFFD in place of what is not UTF-8, and of NUL.
[[nodiscard]] std::string CleanText(std::string_view text);
// Returns the JSON as PostgreSQL accepts it as jsonb, on one line.
[[nodiscard]] std::string JsonbText(nlohmann::ordered_json json);

// A status that is final or a finding.
[[nodiscard]] FleetCommandRow CommandRowOf(const command_status_t& status);
// A command as its client sent it: its state is "issued", "prepare_issued", "commit_issued" or "cancel_issued". `message`: the envelope of `body`.
[[nodiscard]] FleetCommandRow CommandRowOf(const command_t& message, const command_body_t& body);
[[nodiscard]] TripRow TripRowOf(const std::string& name, const trip_log_t& message);

[[nodiscard]] DeviceHealthRow HealthRowOf(const std::string& name, const device_info_t& message);
[[nodiscard]] BusHealthRow HealthRowOf(const std::string& name, const bus_health_t& message);
[[nodiscard]] RecorderHealthRow HealthRowOf(const std::string& name, const recorder_health_t& message);
[[nodiscard]] MotorHealthRow HealthRowOf(const std::string& name, const motor_health_t& message);
[[nodiscard]] ClockRow HealthRowOf(const std::string& name, const time_quality_t& message);

// Return the part of a message whose change makes a row at once: its state, without readings and counters.
[[nodiscard]] std::string StateKeyOf(const device_info_t& message);
[[nodiscard]] std::string StateKeyOf(const bus_health_t& message);
[[nodiscard]] std::string StateKeyOf(const recorder_health_t& message);
[[nodiscard]] std::string StateKeyOf(const motor_health_t& message);
[[nodiscard]] std::string StateKeyOf(const time_quality_t& message);

// `data`: an event of kMachineChannel, received at `utime`.
[[nodiscard]] MachineFileRow MachineFileRowOf(Bytes data, std::int64_t utime);

}  // namespace axlecast
