#pragma once

#include <axlecast/alarm_entry_t.hpp>

#include "core/device/device.h"

namespace axlecast::biss {

// The two status bits of every frame (SAA manual 5.6), both active low. What is behind them is the maker's.
inline constexpr AlarmSpec kErrorAlarm = {
    0x100, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_CRITICAL, "error",
    "The position is not valid: check supply, speed and mounting; replace the encoder"};
inline constexpr AlarmSpec kWarningAlarm = {
    0x101, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_WARNING, "warning",
    "The encoder nears a limit (dirt, ageing, temperature): see its data sheet"};

}  // namespace axlecast::biss
