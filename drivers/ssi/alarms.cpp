#include "drivers/ssi/alarms.h"

#include <array>
#include <axlecast/alarm_entry_t.hpp>

namespace axlecast::ssi {
namespace {

constexpr std::uint8_t kDevice = alarm_entry_t::SOURCE_DEVICE;
constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
constexpr std::int32_t kFirstStatus = 0x120;

struct LineAlarmRow {
  WordError error;
  AlarmSpec spec;
};
constexpr std::array<LineAlarmRow, 6> kLineAlarms = {{
    {WordError::kNoZero,
     {0x100, kDriver, kError, "no_encoder",
      "Data stays high: check power, data and clock wires, and the receiver"}},
    {WordError::kIdleLow,
     {0x101, kDriver, kError, "data_line_low",
      "Data is low before the clock: D+ and D- swapped, a short, or pause_us too short"}},
    {WordError::kRepeat,
     {0x102, kDriver, kError, "repeat_differs",
      "The words of one transfer differ: check cable, monoflop_us, bits and repeat"}},
    {WordError::kTrailing,
     {0x103, kDriver, kError, "trailing_bits",
      "What follows the word is not as configured: check bits, trailing, monoflop_us"}},
    {WordError::kPadding,
     {0x104, kDriver, kError, "padding_not_zero", "Unused bits are set: check bits, turn_bits, format, cable_m"}},
    {WordError::kParity, {0x105, kDriver, kError, "parity", "Parity fails: check parity, bits and the cable"}},
}};

}  // namespace

const AlarmSpec* LineAlarm(WordError error) {
  for (const LineAlarmRow& row : kLineAlarms) {
    if (row.error == error) return &row.spec;
  }
  return nullptr;
}

AlarmSpec StatusAlarm(const StatusBit& bit, std::size_t index) {
  return {kFirstStatus + static_cast<std::int32_t>(index), kDevice, bit.is_error ? kError : kWarning,
          bit.name.c_str(),
          bit.is_error ? "The encoder says that its position is not valid: see its data sheet"
                       : "The encoder warns: see its data sheet"};
}

}  // namespace axlecast::ssi
