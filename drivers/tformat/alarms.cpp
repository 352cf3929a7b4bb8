#include "drivers/tformat/alarms.h"

#include <axlecast/alarm_entry_t.hpp>
#include <bit>

#include "core/device/operation.h"
#include "drivers/tformat/codec.h"

namespace axlecast::tformat {
namespace {

constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
constexpr std::uint8_t kCritical = alarm_entry_t::SEVERITY_CRITICAL;

constexpr DeviceAlarm Alarm(std::uint8_t bit, const char* symbol, bool latched, std::uint8_t severity,
                            const char* name, const char* action) {
  return {
      bit, symbol, latched, {0x100 + std::countr_zero(bit), alarm_entry_t::SOURCE_DEVICE, severity, name, action}};
}

constexpr std::array<DeviceAlarm, 7> kAlarms = {
    Alarm(kAlmOverSpeed, "OS", true, kError, "over_speed",
          "Turns may be wrong: reset turns and errors, then reference again"),
    Alarm(kAlmFullAbsolute, "FS", false, kWarning, "full_absolute_status",
          "Accuracy is 5 bits: slow down below 100 rpm and wait until it clears itself"),
    Alarm(kAlmCountingError, "CE", false, kCritical, "counting_error",
          "Stop the servo system at once; if it stays, turn the power off and on"),
    Alarm(kAlmCounterOverflow, "OF", true, kWarning, "counter_overflow",
          "Turns have passed 65535 and continue from 0: clear the errors"),
    Alarm(kAlmMultiTurnError, "ME", true, kError, "multi_turn_error",
          "Return to the origin position, then reset turns and errors"),
    Alarm(kAlmBatteryError, "BE", true, kError, "battery_error",
          "Check or replace the battery, then reset turns and errors"),
    Alarm(kAlmBatteryAlarm, "BA", false, kWarning, "battery_alarm",
          "Check or replace the battery; the alarm clears itself"),
};

}  // namespace

const std::array<DeviceAlarm, 7>& DeviceAlarms() { return kAlarms; }

const AlarmSpec kWrongIdentity = {0x110, alarm_entry_t::SOURCE_DRIVER, kCritical, "wrong_identity",
                                  "Another encoder is connected than configured: check cables and configuration"};
const AlarmSpec kMisreadRequest = {0x111, alarm_entry_t::SOURCE_DEVICE, kWarning, "communication_alarm",
                                   "The encoder misread a request: check cable, shield and termination"};

std::string AlarmText(std::uint8_t alarms) {
  std::string text = Text("0x%02X", unsigned{alarms});
  for (const DeviceAlarm& alarm : kAlarms) {
    if ((alarms & alarm.bit) != 0) text.append(" ").append(alarm.symbol);
  }
  return text;
}

}  // namespace axlecast::tformat
