#pragma once

#include <axlecast/alarm_entry_t.hpp>

#include "core/device/device.h"

namespace axlecast::saa_modbus {

// The encoder reports no alarms of its own. This one is up while the driver follows it to an address or a baud rate
// that the file does not name: after a restart it would look for it in the wrong place.
inline constexpr AlarmSpec kConfigurationDiffers = {
    0x200, alarm_entry_t::SOURCE_DRIVER, alarm_entry_t::SEVERITY_WARNING, "configuration_differs",
    "Change link.baud or address in the file to what the encoder has, then restart"};

}  // namespace axlecast::saa_modbus
