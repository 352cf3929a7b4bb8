#include "drivers/tsubaki_sc/interpreter.h"

#include <axlecast/alarm_entry_t.hpp>

#include "core/device/operation.h"

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::uint8_t kDevice = alarm_entry_t::SOURCE_DEVICE;
constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;

constexpr const char* kTooMuch = "Tripped: look for an overload or a jam, see the trip log, then start again";
constexpr const char* kTooLittle = "Tripped: look for a lost load, a broken chain or belt; see the trip log";

constexpr std::array<MotorAlarm, 6> kAlarms = {{
    {0x01, {0x200, kDevice, kError, "power_upper_limit_a", kTooMuch}},
    {0x02, {0x201, kDevice, kError, "power_upper_limit_b", kTooMuch}},
    {0x04, {0x202, kDevice, kError, "power_lower_limit_a", kTooLittle}},
    {0x08, {0x203, kDevice, kError, "power_lower_limit_b", kTooLittle}},
    {0x20,
     {0x205, kDevice, kError, "overheat", "Tripped: the unit is extremely hot; let it cool, look for the cause"}},
    {0x40,
     {0x206, kDevice, kError, "excessive_shock",
      "Tripped: look for a collision or a loose part; see the trip log"}},
}};

}  // namespace

const std::array<MotorAlarm, 6>& MotorAlarms() { return kAlarms; }

const AlarmSpec kWrongPassword = {
    0x210, kDriver, kWarning, "wrong_password",
    "The unit refused the password: correct its file, then `log_in`. Not tried again"};
const AlarmSpec kLoginFailed = {0x211, kDriver, kWarning, "login_failed",
                                "motor_control needs the unit logged in, but it is not: run `log_in` to see why"};

const AlarmSpec kStillLoggedIn = {0x212, kDriver, kWarning, "still_logged_in",
                                  "The unit could not be logged out: run `log_out` to see why"};

std::vector<AlarmSpec> Alarms() {
  std::vector<AlarmSpec> alarms = {kWrongPassword, kLoginFailed, kStillLoggedIn};
  for (const MotorAlarm& alarm : kAlarms) alarms.push_back(alarm.spec);
  return alarms;
}

std::string StatusText(std::int32_t bits) {
  std::string text = Text("0x%02X", static_cast<unsigned>(bits));
  for (const MotorAlarm& alarm : kAlarms) {
    if ((bits & alarm.bit) != 0) text.append(" ").append(alarm.spec.name);
  }
  return text;
}

}  // namespace axlecast::tsubaki_sc
