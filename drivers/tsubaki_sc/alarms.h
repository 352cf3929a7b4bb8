#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/device/device.h"

namespace axlecast::tsubaki_sc {

// A bit of the motor status (AI 201) and of the trip factors (AI 202-204): guideline 10, note 1.
struct MotorAlarm {
  std::uint16_t bit;
  AlarmSpec spec;  // code 0x200 + the bit's number
};

// In the order of their bits.
[[nodiscard]] const std::array<MotorAlarm, 6>& MotorAlarms();

// All bits that the guideline names. One of them in the motor status: the motor is tripped.
inline constexpr std::uint16_t kTripBits = 0x6F;

extern const AlarmSpec kWrongPassword;
extern const AlarmSpec kLoginFailed;
extern const AlarmSpec kStillLoggedIn;

// "0x02 power_upper_limit_b"
[[nodiscard]] std::string StatusText(std::int32_t bits);

}  // namespace axlecast::tsubaki_sc
