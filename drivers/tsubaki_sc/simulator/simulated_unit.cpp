#include "drivers/tsubaki_sc/simulator/bus_simulator.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "drivers/kit/arguments.h"

namespace axlecast::tsubaki_sc::simulator {
namespace {

using Unit = SimulatedUnit;
using Quantity = SimulatedQuantity<SimulatedUnit>;
using Words = std::string_view;

// Parses a number and passes it to `set`.
template <typename Set>
Result<> SetNumber(Words value, double min, double max, Words unit, Set set) {
  const Result<double> number = ParseNumber(value, min, max, unit);
  if (!number) return Failure(number.error());
  set(*number);
  return {};
}

// ---- the unit ----

// The error does not contain the password.
Result<> SetPassword(Unit& s, Words value) {
  Characters characters{};
  if (value.size() > characters.size()) return Failure("has more than 16 characters");
  std::copy(value.begin(), value.end(), characters.begin());
  const WrittenPassword written = Unpadded(characters);
  if (!written.length_fits || !written.characters_fit) return Failure("is not 8 to 16 characters of '!' to '~'");
  s.unit.access.SetPassword(written.text);
  return {};
}

// "52=900 53=5000": parameters by address.
Result<> SetParameters(Unit& s, Words value) {
  std::vector<std::pair<std::uint16_t, std::uint16_t>> presets;
  while (!value.empty()) {
    const Words part = value.substr(0, value.find(' '));
    value.remove_prefix(std::min(value.size(), part.size() + 1));
    const std::size_t equals = part.find('=');
    if (equals == Words::npos) return Failure(Quoted(part) + " is not ADDRESS=VALUE, e.g. 52=900");
    const auto address = ParseWholeNumber(part.substr(0, equals), 0, kParameterCount - 1, "");
    if (!address) return Failure(address.error());
    const Range range = ParameterRange(static_cast<std::uint16_t>(*address));
    const auto amount = ParseWholeNumber(part.substr(equals + 1), range.low, range.high, "");
    if (!amount) return Failure("address " + std::to_string(*address) + ": " + amount.error().text);
    presets.emplace_back(static_cast<std::uint16_t>(*address), static_cast<std::uint16_t>(*amount));
  }
  for (const auto& [address, amount] : presets) s.unit.PresetParameter(address, amount);
  return {};
}

std::string ShowParameters(const Unit& s) {
  std::string text;
  for (std::uint16_t address = kParameters; address < kParameterCount; ++address) {
    text += (text.empty() ? "" : " ") + std::to_string(s.unit.HoldingRegister(address));
  }
  return text;
}

// "01 00": upper and lower, as they are sent.
Result<> SetVersion(Unit& s, Words value) {
  const std::optional<std::vector<std::uint8_t>> bytes = ParseHex(value);
  if (!bytes || bytes->size() != 2) return Failure(Quoted(value) + " is not two bytes in hex, e.g. 01 00");
  s.unit.settings.version = {bytes->at(0), bytes->at(1)};
  return {};
}

Quantity CodeQuantity(Words name, std::size_t maximum, std::string ScUnit::Settings::*code) {
  return {name,
          [=](Unit& s, Words value) -> Result<> {
            const bool printable =
                std::all_of(value.begin(), value.end(), [](char c) { return c >= 0x20 && c <= 0x7E; });
            if (value.size() > maximum || !printable) {
              return Failure("is not up to " + std::to_string(maximum) + " ASCII characters");
            }
            s.unit.settings.*code = value;
            return {};
          },
          [=](const Unit& s) { return s.unit.settings.*code; }};
}

Result<> SetPower(Unit& s, Words value) {
  constexpr std::array<Words, 3> kStates = {"on", "off", "cycle"};
  if (const auto state = ParseChoice(value, kStates); !state) return Failure(state.error());
  if (value != "on") s.unit.SetPower(false);
  if (value != "off") s.unit.SetPower(true);
  return {};
}

Result<> SetFault(Unit& s, Words value) {
  const Result<UnitFault> fault = UnitFault::Parse(value);
  if (!fault) return Failure(fault.error());
  s.fault = *fault;
  s.unit.SetStuck(fault->line.kind == SimulatedFault::Kind::kStuck);
  return {};
}

std::string FaultOf(const Unit& s) {
  if (s.fault.wrong_address != 0) return "wrong_address:" + std::to_string(s.fault.wrong_address);
  if (s.fault.exception != 0) return "exception:" + std::to_string(s.fault.exception);
  return FaultText(s.fault.line);
}

// ---- the motor ----

Result<> SetLoad(Unit& s, Words value) {
  return SetNumber(value, 0, 6000, "W", [&](double watts) { s.unit.motor.SetLoad(watts); });
}

Result<> SetProfile(Unit& s, Words value) {
  Result<LoadProfile> profile = LoadProfile::Parse(value);
  if (!profile) return Failure(profile.error());
  s.unit.motor.SetProfile(*std::move(profile), s.unit.now());
  return {};
}

Result<> SetSpeed(Unit& s, Words value) {
  return SetNumber(value, 0.1, 3000, "rpm", [&](double rpm) { s.unit.motor.settings.speed_rpm = rpm; });
}

Result<> SetTemperature(Unit& s, Words value) {
  return SetNumber(value, -50, 300, "C", [&](double celsius) { s.unit.motor.SetTemperature(celsius); });
}

constexpr double kMaxAccel = 320;  // a signed register holds 327.67

// "x:180"
Result<> SetShock(Unit& s, Words value) {
  const Words axis = value.substr(0, value.find(':'));
  const std::size_t index = Words("xyz").find(axis);
  if (axis.size() != 1 || index == Words::npos || axis.size() == value.size()) {
    return Failure(Quoted(value) + " is not AXIS:MPS2, e.g. x:180");
  }
  return SetNumber(value.substr(2), -kMaxAccel, kMaxAccel, "m/s^2",
                   [&](double mps2) { s.unit.motor.Shock(index, mps2, s.unit.now()); });
}

Result<> ForceTrip(Unit& s, Words value) {
  std::vector<Words> names;
  names.reserve(kCauses.size());
  for (const Cause& cause : kCauses) names.push_back(cause.name);
  const Result<std::size_t> cause = ParseChoice(value, names);
  if (!cause) return Failure(cause.error());
  if (!s.unit.ForceTrip(kCauses.at(*cause).bit)) return Failure("cannot trip: the motor does not run");
  return {};
}

Result<> ResetTrip(Unit& s, Words value) {
  if (value != "now") return Failure(Quoted(value) + " is not now");
  s.unit.ResetTrip();
  return {};
}

// ---- the table ----

Quantity MotorNumber(Words name, double GearMotor::Settings::*member, double min, double max) {
  return NumberQuantity<Unit>(
      name, [=](auto& s) -> auto& { return s.unit.motor.settings.*member; }, min, max, "");
}

Quantity Acceleration(Words name, std::size_t axis) {
  return NumberQuantity<Unit>(
      name, [=](auto& s) -> auto& { return s.unit.motor.settings.accel_mps2[axis]; }, -kMaxAccel, kMaxAccel,
      "m/s^2");
}

template <typename Member>
Quantity SettingChoice(Words name, Member ScUnit::Settings::*member, std::initializer_list<Words> words) {
  return ChoiceQuantity<Unit>(
      name, [=](auto& s) -> auto& { return s.unit.settings.*member; }, words);
}

std::string MotorText(const ScUnit& unit) {
  if (unit.motor.running()) return "running";
  return unit.motor_status() != 0 ? "tripped" : "stopped";
}

}  // namespace

// Faults and power come last: they begin after the rest of the mapping is set.
const QuantityTable<SimulatedUnit>& SimulatedUnit::Table() {
  using S = ScUnit::Settings;
  using M = GearMotor::Settings;
  static const QuantityTable<SimulatedUnit> kTable = {
      {"password", SetPassword, nullptr},
      {"parameters", SetParameters, ShowParameters},
      WholeQuantity<Unit>(
          "dip_set", [](auto& s) -> auto& { return s.unit.settings.dip_set; }, 1, 4, ""),
      SettingChoice("mains_hz", &S::mains_60_hz, {"50", "60"}),
      {"version", SetVersion, [](const Unit& s) { return HexText(s.unit.settings.version); }},
      CodeQuantity("product_code", 4, &S::product_code),
      CodeQuantity("mfg_number", 10, &S::mfg_number),
      SettingChoice("register_order", &S::low_byte_first, {"high_first", "low_first"}),
      SettingChoice("character_order", &S::low_character_first, {"high_first", "low_first"}),
      SettingChoice("out_of_range", &S::out_of_range, {"refuse", "keep", "clamp"}),
      MotorNumber("voltage_v", &M::voltage_v, 0, 600),
      MotorNumber("power_factor", &M::power_factor, 0, 1),
      {"speed_rpm", SetSpeed, [](const Unit& s) { return NumberText(s.unit.motor.SpeedAt(s.unit.now())); }},
      MotorNumber("torque_nm", &M::torque_nm, 0, 10'000),
      {"load_w", SetLoad, [](const Unit& s) { return NumberText(s.unit.motor.load_w(s.unit.now())); }},
      {"load_profile", SetProfile, [](const Unit& s) { return s.unit.motor.profile().Text(); }},
      MotorNumber("run_up_w", &M::run_up_w, 0, 6000),
      MotorNumber("run_up_s", &M::run_up_s, 0, 60),
      MotorNumber("ambient_c", &M::ambient_c, -50, 100),
      MotorNumber("heating_c_per_w", &M::heating_c_per_w, 0, 10),
      MotorNumber("thermal_s", &M::thermal_s, 0, 100'000),
      {"temperature_c", SetTemperature,
       [](const Unit& s) { return NumberText(s.unit.motor.At(s.unit.now()).temperature_c); }},
      Acceleration("accel_x_mps2", 0),
      Acceleration("accel_y_mps2", 1),
      Acceleration("accel_z_mps2", 2),
      MotorNumber("vibration_mps2", &M::vibration_mps2, 0, 320),
      {"shock", SetShock, nullptr},
      {"trip", ForceTrip, nullptr},
      {"reset_trip", ResetTrip, nullptr},
      {"fault", SetFault, FaultOf},
      {"power", SetPower, [](const Unit& s) { return std::string(s.unit.powered() ? "on" : "off"); }},
  };
  return kTable;
}

Result<UnitFault> UnitFault::Parse(std::string_view text) {
  const std::size_t colon = text.find(':');
  std::string name(text.substr(0, colon));
  std::replace(name.begin(), name.end(), '-', '_');
  UnitFault fault;
  const bool wrong_address = name == "wrong_address";
  if (wrong_address || name == "exception") {
    constexpr double kUsualAddress = 17;  // no unit has it
    constexpr double kUsualException = 4;
    Result<double> amount = wrong_address ? kUsualAddress : kUsualException;
    if (colon != std::string_view::npos) amount = ParseNumber(text.substr(colon + 1), 1, 255, "");
    if (!amount) return Failure(amount.error());
    (wrong_address ? fault.wrong_address : fault.exception) = static_cast<std::uint8_t>(*amount);
    return fault;
  }
  const Result<SimulatedFault> line = ParseFault(text);
  if (!line) return Failure(line.error().text + ", wrong_address, exception");
  fault.line = *line;
  return fault;
}

QuantityList SimulatedUnit::Quantities() const {
  QuantityList list = ShownQuantities();
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  std::uint16_t address = 100;
  for (const char* name : {"voltage", "current", "power", "temperature", "accel_x", "accel_y", "accel_z"}) {
    const std::uint16_t value = unit.InputRegister(address);
    const bool is_signed = address >= 100 + kTemperatureIndex;
    count(std::string("register_") + name, is_signed ? static_cast<std::int16_t>(value) : value);
    ++address;
  }
  list.emplace_back("motor", MotorText(unit));
  list.emplace_back("motor_status", CauseText(unit.motor_status()));
  count("trip_count", unit.trip_count());
  for (std::size_t log = 0; log < TripLogs::kLogs; ++log) {
    list.emplace_back("trip_factor_" + std::to_string(log + 1), CauseText(unit.logs().factor(log)));
  }
  count("stop_coil", unit.Coil(kCoilStop) ? 1 : 0);
  count("logged_in", unit.access.logged_in() ? 1 : 0);
  count("starts", unit.effects.starts);
  count("stops", unit.effects.stops);
  count("logins", unit.effects.logins);
  count("logouts", unit.effects.logouts);
  count("wrong_passwords", unit.effects.wrong_passwords);
  count("password_changes", unit.effects.password_changes);
  count("parameter_writes", unit.effects.parameter_writes);
  count("trip_count_clears", unit.effects.trip_count_clears);
  return list;
}

}  // namespace axlecast::tsubaki_sc::simulator
