#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/device/device.h"

namespace axlecast::tformat {

// An alarm bit of ALMC: TS5669 spec 6.3.3, Table 3, with the action of spec 6.4.
struct DeviceAlarm {
  std::uint8_t bit;    // of ALMC
  const char* symbol;  // the maker's: OS, FS, CE, OF, ME, BE, BA
  bool latched;        // kept by the encoder until it is reset by command
  AlarmSpec spec;      // code 0x100 + the bit's number
};

// In the order of their bits.
[[nodiscard]] const std::array<DeviceAlarm, 7>& DeviceAlarms();

extern const AlarmSpec kWrongIdentity;
extern const AlarmSpec kMisreadRequest;

// Bits that a reset of errors clears when their cause is gone. CE belongs to them because its case II is latched
// (spec 9), which ALMC does not distinguish from case I.
inline constexpr std::uint8_t kLatchedAlarms = 0x6D;
// Bits after which the multi-turn counter may be wrong: OS, ME, BE.
inline constexpr std::uint8_t kTurnsInDoubt = 0x61;
// Bits that concern the multi-turn counter or its battery: OS, OF, ME, BE, BA.
inline constexpr std::uint8_t kMultiTurnAlarms = 0xE9;

// "0x48 OF BE"
[[nodiscard]] std::string AlarmText(std::uint8_t alarms);

}  // namespace axlecast::tformat
