#pragma once

#include <cstdint>
#include <span>

#include "core/device/device.h"
#include "drivers/saa_can/cia406/canopen.h"

namespace axlecast::saa_can::cia406 {

// Bits of 6503h (alarms) or of 6505h (warnings) that are one alarm towards the outside.
struct DiagnosticAlarm {
  std::uint16_t bits;
  AlarmSpec spec;
};

// An alarm: the position may be wrong. Bit 0 is position error (CiA 406, object 6503h; TR-Electronic CEH 110 manual
// 10.12.4; Pepperl+Fuchs absolute rotary encoder manual 2017-04, 9.5.69), bit 1 commissioning diagnostics (the same
// 9.5.69), bits 12 to 15 the manufacturer's.
[[nodiscard]] std::span<const DiagnosticAlarm> Alarms();
inline constexpr std::uint16_t kPositionError = 0x0001;
// A warning: a tolerance is exceeded, the position is right (object 6505h; the same manual, 9.5.71 with its table).
[[nodiscard]] std::span<const DiagnosticAlarm> Warnings();
// Bits that mean the same in every encoder. The manufacturer's are heeded where 6504h or 6506h says that they
// exist.
inline constexpr std::uint16_t kStandardBits = 0x0FFF;

// Of an EMCY: code 0x10000 + the error code, name by its class.
[[nodiscard]] AlarmSpec EmergencyAlarm(std::uint16_t error_code);
// The bit of the error register that speaks of this error code's class; 0 where the standard names none.
[[nodiscard]] std::uint8_t RegisterBitOf(std::uint16_t error_code);

extern const AlarmSpec kWrongEncoder;
extern const AlarmSpec kHeartbeatLost;
extern const AlarmSpec kNotOperational;
extern const AlarmSpec kSecondSync;
extern const AlarmSpec kPeriodDiffers;
extern const AlarmSpec kMoreEmergencies;

}  // namespace axlecast::saa_can::cia406
