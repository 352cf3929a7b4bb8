#pragma once

#include <cstdint>
#include <string>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "drivers/runtime/axis/device_publisher.h"

namespace axlecast {

// The commands that the runtime executes without the device. About an alarm (IsAboutAlarms): acknowledge_alarm, shelve_alarm,
// unshelve_alarm and restore_acknowledgement. About the datum of the axis: set_datum, clear_datum and mark_reference_lost.
//
// Executes such a command. The error has a REASON_*. `unix_us`: now.
[[nodiscard]] Result<Outcome> ExecuteAxisCommand(DevicePublisher& publisher, const DriverCommand& command,
                                                 std::int64_t unix_us);
// Returns what ExecuteAxisCommand would report. Changes nothing.
[[nodiscard]] Result<Outcome> PrepareAxisCommand(const DevicePublisher& publisher, const DriverCommand& command,
                                                 std::int64_t unix_us);

// Returns a number in the unit of the axis as text; no text for NaN, an unknown number.
[[nodiscard]] std::string ValueText(double value);

}  // namespace axlecast
