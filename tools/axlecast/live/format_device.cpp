#include "tools/axlecast/live/format_device.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/monitor/trip_margins.h"

namespace axlecast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

bool Has(const motor_health_t& motor, std::int32_t flag) { return (motor.flags & flag) != 0; }

double Analog(const motor_health_t& motor, float value) {
  return Has(motor, motor_health_t::FLAG_ANALOG_VALID) ? static_cast<double>(value) : kUnknown;
}

// Returns the length of the acceleration vector in m/s^2, including gravity, or NaN.
double AccelMagnitude(const motor_health_t& motor) {
  return std::hypot(Analog(motor, motor.accel_mps2[0]), Analog(motor, motor.accel_mps2[1]),
                    Analog(motor, motor.accel_mps2[2]));
}

// Widths of the columns after name and state.
std::string Columns(const std::string& volts, const std::string& amperes, const std::string& watts,
                    const std::string& temperature, const std::string& accel, const std::string& trips,
                    const std::string& age) {
  return Right(volts, 8) + ' ' + Right(amperes, 8) + ' ' + Right(watts, 8) + ' ' + Right(temperature, 7) + ' ' +
         Right(accel, 7) + ' ' + Right(trips, 6) + ' ' + Right(age, 7);
}

// Decimals that show one count, 0..6.
int DecimalsOf(const device_info_t& info) {
  const double counts = static_cast<double>(info.counts_per_turn) * static_cast<double>(info.ratio_den);
  const double count = counts > 0 ? info.per_turn * static_cast<double>(info.ratio_num) / counts : 0;
  if (!(std::abs(count) > 0)) return 3;
  return static_cast<int>(std::clamp(std::ceil(-std::log10(std::abs(count))), 0.0, 6.0));
}

std::string Amount(const TripMargin& margin, double value) {
  switch (margin.status_bit) {
    case motor_health_t::STATUS_OVERHEAT:
      return Decimal(value, 1) + " degC";
    case motor_health_t::STATUS_EXCESSIVE_SHOCK:
      return Decimal(value, 2) + " m/s2";
    default:
      return Decimal(value, 1) + " W";
  }
}

std::string LimitText(const TripMargin& margin) {
  const std::string name = MotorStatusNames(margin.status_bit);
  if (!std::isfinite(margin.limit)) return name + " not read yet";
  if (margin.limit <= 0) return name + " off";
  const bool below = (margin.status_bit & (std::int32_t{motor_health_t::STATUS_POWER_LOWER_A} |
                                           motor_health_t::STATUS_POWER_LOWER_B)) != 0;
  const std::string left =
      margin.margin < 0 ? Amount(margin, -margin.margin) + " beyond" : Amount(margin, margin.margin) + " left";
  return name + (below ? " below " : " above ") + Amount(margin, margin.limit) + ": now " +
         Amount(margin, margin.measured) + ", " + left;
}

std::array<TripMargin, 6> MarginsOf(const DeviceView& device) {
  return TripMargins(device.motor.value_or(motor_health_t{}), *device.limits);
}

std::string FirstRow(const DeviceView& device, MonoNs now) {
  const std::string head = Left(device.name, 12) + ' ' + Left(device.StateText(now), 8) + ' ';
  if (!device.motor) return head + Columns("-", "-", "-", "-", "-", "-", "-");
  const motor_health_t& motor = *device.motor;
  const std::string trips = Has(motor, motor_health_t::FLAG_STATUS_VALID) ? std::to_string(motor.trip_count) : "-";
  return head + Columns(Decimal(Analog(motor, motor.voltage_v), 1), Decimal(Analog(motor, motor.current_a), 3),
                        Decimal(Analog(motor, motor.power_w), 1), Decimal(Analog(motor, motor.temperature_c), 1),
                        Decimal(AccelMagnitude(motor), 2), trips,
                        Decimal(static_cast<double>(now - device.reading_at) / 1e9, 1));
}

}  // namespace

std::string MotorValueText(const motor_health_t& motor) {
  return Decimal(Analog(motor, motor.power_w), 1) + " W " + Decimal(Analog(motor, motor.temperature_c), 1) +
         " degC";
}

std::string MotorQuantities(const motor_health_t& motor) {
  return Decimal(Analog(motor, motor.voltage_v), 1) + " V, " + Decimal(Analog(motor, motor.current_a), 3) + " A, " +
         Decimal(Analog(motor, motor.power_w), 1) + " W, " + Decimal(Analog(motor, motor.temperature_c), 1) +
         " degC, " + Decimal(AccelMagnitude(motor), 2) + " m/s2";
}

std::string MotorStatusText(const motor_health_t& motor) {
  if (!Has(motor, motor_health_t::FLAG_STATUS_VALID)) return "status not read yet";
  const std::string names = MotorStatusNames(motor.status_bits);
  std::string text = names.empty() ? "no trip" : names;
  if (motor.stop_coil == 1) text += ", stop commanded";
  if (motor.stop_coil == 0) text += ", no stop commanded";
  if (motor.logged_in == 1) text += ", logged in";
  if (motor.logged_in == 0) text += ", logged out";
  if (motor.mains_hz > 0) text += ", " + std::to_string(motor.mains_hz) + " Hz mains";
  return text;
}

std::string MarginsText(const DeviceView& device) {
  if (!device.limits) return "";
  std::string text;
  for (const TripMargin& margin : MarginsOf(device)) {
    if (!(margin.limit > 0)) continue;
    text += (text.empty() ? "to trip: " : ", ") + MotorStatusNames(margin.status_bit) + ' ' +
            Amount(margin, margin.margin);
  }
  return text;
}

std::vector<std::string> LimitTexts(const DeviceView& device) {
  std::vector<std::string> texts;
  if (!device.limits) return texts;
  for (const TripMargin& margin : MarginsOf(device)) texts.push_back(LimitText(margin));
  return texts;
}

std::string MotorHeading() {
  return "MOTOR        STATE    " + Columns("V", "A", "W", "degC", "m/s2", "TRIPS", "AGE s");
}

void AddMotorRows(const DeviceView& device, MonoNs now, std::vector<std::string>& lines) {
  const auto add = [&lines](const std::string& note) { lines.push_back(Clip("  " + note, kTableWidth)); };
  lines.push_back(FirstRow(device, now));
  if (device.motor) add(MotorStatusText(*device.motor));
  if (const std::string margins = MarginsText(device); !margins.empty()) add(margins);
  if (const std::string alarms = AlarmText(device, kTableWidth); !alarms.empty()) add("alarms: " + alarms);
  if (!device.Online(now) && device.info && !device.info->reason.empty()) add(Printable(device.info->reason));
}

std::string ValueText(const DeviceView& device) {
  if (!device.has_position) return device.motor ? MotorValueText(*device.motor) : "-";
  if (!device.valid) return "-";
  const int decimals = device.info ? DecimalsOf(*device.info) : 3;
  return Decimal(device.valid->value, decimals) + ' ' + std::string(UnitName(device.valid->unit));
}

std::string AlarmText(const DeviceView& device, std::size_t width) {
  const std::vector<alarm_entry_t>& alarms = device.alarms.entries();
  if (alarms.empty()) return "";
  const std::string more = alarms.size() > 1 ? " +" + std::to_string(alarms.size() - 1) : "";
  const std::size_t room = width > more.size() ? width - more.size() : 0;
  return Clip(Printable(alarms.front().name), room) + more;
}

std::string PresentText(const DeviceView& device, MonoNs now) {
  if (!device.has_position) {
    if (!device.motor) return device.name + ": present state not known, no MOTOR came";
    return device.name + ": " + MotorQuantities(*device.motor) + "; " + MotorStatusText(*device.motor);
  }
  if (!device.valid) return device.name + ": present position not known, no valid POSITION came";
  std::string text = device.name + " is at " + ValueText(device) + " (" + Decimal(device.Turns(), 4) + " turns, " +
                     Decimal(device.SpeedRpm(), 1) + " rpm), ";
  text += device.Online(now) ? "ONLINE" : "not ONLINE";
  const std::string alarms = AlarmText(device, 60);
  return alarms.empty() ? text : text + ", alarms: " + alarms;
}

std::string NoAnswer(const DeviceView& device) {
  return device.name + ": no answer; is its driver running? (axlecast driver " + device.bus + ")";
}

std::string UnknownDevice(const MachineConfig& machine, std::string_view name) {
  const std::vector<std::string> names = MachineNames(machine, true);
  const auto nearest = NearestWord(name, names);
  return "no device " + Quoted(name) + " in " + machine.file + (nearest ? "; did you mean " + *nearest + '?' : "") +
         "\ndevices: " + Listed(names);
}

}  // namespace axlecast
