#include "drivers/tformat/alarms.h"

#include <axlecast/alarm_entry_t.hpp>

#include "core/device/operation.h"
#include "drivers/tformat/codec.h"

namespace axlecast::tformat {
namespace {

constexpr std::uint8_t kDevice = alarm_entry_t::SOURCE_DEVICE;
constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
constexpr std::uint8_t kCritical = alarm_entry_t::SEVERITY_CRITICAL;

constexpr std::array<DeviceAlarm, 7> kAlarms = {{
    {kAlmOverSpeed,
     "OS",
     true,
     {0x100, kDevice, kError, "over_speed", "Turns may be wrong: reset turns and errors, then reference again"}},
    {kAlmFullAbsolute,
     "FS",
     false,
     {0x101, kDevice, kWarning, "full_absolute_status",
      "Accuracy is 5 bits: slow down below 100 rpm and wait until it clears itself"}},
    {kAlmCountingError,
     "CE",
     false,
     {0x102, kDevice, kCritical, "counting_error",
      "Stop the servo system at once; if it stays, turn the power off and on"}},
    {kAlmCounterOverflow,
     "OF",
     true,
     {0x103, kDevice, kWarning, "counter_overflow",
      "Turns have passed 65535 and continue from 0: clear the errors"}},
    {kAlmMultiTurnError,
     "ME",
     true,
     {0x105, kDevice, kError, "multi_turn_error", "Return to the origin position, then reset turns and errors"}},
    {kAlmBatteryError,
     "BE",
     true,
     {0x106, kDevice, kError, "battery_error", "Check or replace the battery, then reset turns and errors"}},
    {kAlmBatteryAlarm,
     "BA",
     false,
     {0x107, kDevice, kWarning, "battery_alarm", "Check or replace the battery; the alarm clears itself"}},
}};

}  // namespace

const std::array<DeviceAlarm, 7>& DeviceAlarms() { return kAlarms; }

const AlarmSpec kWrongIdentity = {0x110, kDriver, kCritical, "wrong_identity",
                                  "Another encoder is connected than configured: check cables and configuration"};
const AlarmSpec kMisreadRequest = {0x111, kDevice, kWarning, "communication_alarm",
                                   "The encoder misread a request: check cable, shield and termination"};

std::string AlarmText(std::uint8_t alarms) {
  std::string text = Text("0x%02X", unsigned{alarms});
  for (const DeviceAlarm& alarm : kAlarms) {
    if ((alarms & alarm.bit) != 0) text.append(" ").append(alarm.symbol);
  }
  return text;
}

}  // namespace axlecast::tformat
