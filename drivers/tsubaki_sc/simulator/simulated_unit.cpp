#include "drivers/tsubaki_sc/simulator/simulated_unit.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/simulation/quantity.h"

namespace axlecast::tsubaki_sc::simulator {
namespace {

using Text = std::string_view;

constexpr double kUsualWrongAddress = 17;  // no unit has it
constexpr double kUsualException = 4;

template <typename Words>
std::string NoneOf(Text value, const Words& words) {
  std::string list;
  for (const Text word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return "'" + std::string(value) + "' is none of " + list;
}

// The place of `value` in `words`.
template <std::size_t N>
std::optional<std::size_t> Place(const std::array<Text, N>& words, Text value) {
  const auto* found = std::find(words.begin(), words.end(), value);
  if (found == words.end()) return std::nullopt;
  return static_cast<std::size_t>(found - words.begin());
}

std::string ReadWhole(Text value, int min, int max, int& into) {
  const std::optional<std::int64_t> number = ParseWhole(value, min, max);
  if (!number) {
    return "'" + std::string(value) + "' is no whole number from " + std::to_string(min) + " to " +
           std::to_string(max);
  }
  into = static_cast<int>(*number);
  return {};
}

// ---- the unit ----

// The error does not contain the password.
std::string SetPassword(SimulatedUnit& s, Text value) {
  Characters characters{};
  if (value.size() > characters.size()) return "has more than 16 characters";
  std::copy(value.begin(), value.end(), characters.begin());
  const WrittenPassword written = Unpadded(characters);
  if (!written.length_fits || !written.characters_fit) return "is not 8 to 16 characters of '!' to '~'";
  s.unit.access.SetPassword(written.text);
  return {};
}

// "52=900 53=5000": parameters by address.
std::string SetParameters(SimulatedUnit& s, Text value) {
  std::vector<std::pair<std::uint16_t, std::uint16_t>> presets;
  while (!value.empty()) {
    const Text part = value.substr(0, value.find(' '));
    value.remove_prefix(std::min(value.size(), part.size() + 1));
    const std::size_t equals = part.find('=');
    int address = 0;
    int amount = 0;
    if (equals == Text::npos) return "'" + std::string(part) + "' is not ADDRESS=VALUE, e.g. 52=900";
    if (std::string p = ReadWhole(part.substr(0, equals), 0, kParameterCount - 1, address); !p.empty()) return p;
    const Range range = ParameterRange(static_cast<std::uint16_t>(address));
    if (std::string p = ReadWhole(part.substr(equals + 1), range.low, range.high, amount); !p.empty()) {
      return "address " + std::to_string(address) + ": " + p;
    }
    presets.emplace_back(static_cast<std::uint16_t>(address), static_cast<std::uint16_t>(amount));
  }
  for (const auto& [address, amount] : presets) s.unit.PresetParameter(address, amount);
  return {};
}

std::string ShowParameters(const SimulatedUnit& s) {
  std::string text;
  for (std::uint16_t address = kParameters; address < kParameterCount; ++address) {
    text += (text.empty() ? "" : " ") + std::to_string(s.unit.HoldingRegister(address));
  }
  return text;
}

std::string SetDipSet(SimulatedUnit& s, Text value) { return ReadWhole(value, 1, 4, s.unit.settings.dip_set); }

constexpr std::array<Text, 2> kMains = {"50", "60"};

std::string SetMains(SimulatedUnit& s, Text value) {
  const auto place = Place(kMains, value);
  if (!place) return NoneOf(value, kMains);
  s.unit.settings.mains_60_hz = *place == 1;
  return {};
}

// "01 00": upper and lower, as they are sent.
std::string SetVersion(SimulatedUnit& s, Text value) {
  const std::optional<std::vector<std::uint8_t>> bytes = ParseHex(value);
  if (!bytes || bytes->size() != 2) return "'" + std::string(value) + "' is not two bytes in hex, e.g. 01 00";
  s.unit.settings.version = {bytes->at(0), bytes->at(1)};
  return {};
}

std::string SetCode(Text value, std::size_t maximum, std::string& into) {
  const bool printable = std::all_of(value.begin(), value.end(), [](char c) { return c >= 0x20 && c <= 0x7E; });
  if (value.size() > maximum || !printable) return "is not up to " + std::to_string(maximum) + " ASCII characters";
  into = value;
  return {};
}

constexpr std::array<Text, 2> kOrders = {"high_first", "low_first"};

std::string SetOrder(Text value, bool& low_first) {
  const auto place = Place(kOrders, value);
  if (!place) return NoneOf(value, kOrders);
  low_first = *place == 1;
  return {};
}

constexpr std::array<Text, 3> kOutOfRange = {"refuse", "keep", "clamp"};

std::string SetOutOfRange(SimulatedUnit& s, Text value) {
  const auto place = Place(kOutOfRange, value);
  if (!place) return NoneOf(value, kOutOfRange);
  s.unit.settings.out_of_range = static_cast<ScUnit::OutOfRange>(*place);
  return {};
}

// ---- the motor ----

std::string SetLoad(SimulatedUnit& s, Text value) {
  double watts = 0;
  std::string problem = ReadNumber(value, 0, 6000, "W", watts);
  if (problem.empty()) s.unit.motor.SetLoad(watts);
  return problem;
}

std::string SetProfile(SimulatedUnit& s, Text value) {
  LoadProfile profile;
  std::string problem = profile.Parse(value);
  if (problem.empty()) s.unit.motor.SetProfile(std::move(profile), s.unit.now());
  return problem;
}

std::string SetTemperature(SimulatedUnit& s, Text value) {
  double celsius = 0;
  std::string problem = ReadNumber(value, -50, 300, "C", celsius);
  if (problem.empty()) s.unit.motor.SetTemperature(celsius);
  return problem;
}

constexpr std::array<Text, 3> kAxes = {"x", "y", "z"};
constexpr double kMaxAccel = 320;  // a signed register holds 327.67

// "x:180"
std::string SetShock(SimulatedUnit& s, Text value) {
  const std::size_t colon = value.find(':');
  const auto axis = Place(kAxes, value.substr(0, colon));
  if (!axis || colon == Text::npos) return "'" + std::string(value) + "' is not AXIS:MPS2, e.g. x:180";
  double mps2 = 0;
  std::string problem = ReadNumber(value.substr(colon + 1), -kMaxAccel, kMaxAccel, "m/s^2", mps2);
  if (problem.empty()) s.unit.motor.Shock(*axis, mps2, s.unit.now());
  return problem;
}

std::string ForceTrip(SimulatedUnit& s, Text value) {
  for (const Cause& cause : kCauses) {
    if (cause.name != value) continue;
    return s.unit.ForceTrip(cause.bit) ? "" : "cannot trip: the motor does not run";
  }
  std::array<Text, kCauses.size()> names;
  std::transform(kCauses.begin(), kCauses.end(), names.begin(), [](const Cause& cause) { return cause.name; });
  return NoneOf(value, names);
}

std::string ResetTrip(SimulatedUnit& s, Text value) {
  if (value != "now") return "'" + std::string(value) + "' is not now";
  s.unit.ResetTrip();
  return {};
}

std::string SetPower(SimulatedUnit& s, Text value) {
  constexpr std::array<Text, 3> kStates = {"on", "off", "cycle"};
  if (!Place(kStates, value)) return NoneOf(value, kStates);
  if (value != "on") s.unit.SetPower(false);
  if (value != "off") s.unit.SetPower(true);
  return {};
}

std::string SetFault(SimulatedUnit& s, Text value) {
  std::string problem = ParseUnitFault(value, s.fault);
  if (problem.empty()) s.unit.SetStuck(s.fault.line.kind == SimulatedFault::Kind::kStuck);
  return problem;
}

// ---- the table ----

using Quantity = SimulatedQuantity<SimulatedUnit>;

// A plain number of the motor.
template <double GearMotor::Settings::*kMember, int kMin, int kMax>
Quantity Number(Text name) {
  return {name,
          [](SimulatedUnit& s, Text v) { return ReadNumber(v, kMin, kMax, "", s.unit.motor.settings.*kMember); },
          [](const SimulatedUnit& s) { return NumberText(s.unit.motor.settings.*kMember); }};
}

template <std::size_t kAxis>
Quantity Acceleration(Text name) {
  return {name,
          [](SimulatedUnit& s, Text v) {
            return ReadNumber(v, -kMaxAccel, kMaxAccel, "m/s^2", s.unit.motor.settings.accel_mps2[kAxis]);
          },
          [](const SimulatedUnit& s) { return NumberText(s.unit.motor.settings.accel_mps2[kAxis]); }};
}

std::string SetSpeed(SimulatedUnit& s, Text value) {
  return ReadNumber(value, 0.1, 3000, "rpm", s.unit.motor.settings.speed_rpm);
}

// Faults and power come last: the rest of the mapping holds when they begin.
const QuantityTable<SimulatedUnit>& Table() {
  using S = SimulatedUnit;
  using M = GearMotor::Settings;
  static const QuantityTable<SimulatedUnit> kTable = {
      {"password", SetPassword, nullptr},
      {"parameters", SetParameters, ShowParameters},
      {"dip_set", SetDipSet, [](const S& s) { return std::to_string(s.unit.settings.dip_set); }},
      {"mains_hz", SetMains, [](const S& s) { return std::string(kMains[s.unit.settings.mains_60_hz ? 1 : 0]); }},
      {"version", SetVersion, [](const S& s) { return HexText(s.unit.settings.version); }},
      {"product_code", [](S& s, Text v) { return SetCode(v, 4, s.unit.settings.product_code); },
       [](const S& s) { return s.unit.settings.product_code; }},
      {"mfg_number", [](S& s, Text v) { return SetCode(v, 10, s.unit.settings.mfg_number); },
       [](const S& s) { return s.unit.settings.mfg_number; }},
      {"register_order", [](S& s, Text v) { return SetOrder(v, s.unit.settings.low_byte_first); },
       [](const S& s) { return std::string(kOrders[s.unit.settings.low_byte_first ? 1 : 0]); }},
      {"character_order", [](S& s, Text v) { return SetOrder(v, s.unit.settings.low_character_first); },
       [](const S& s) { return std::string(kOrders[s.unit.settings.low_character_first ? 1 : 0]); }},
      {"out_of_range", SetOutOfRange,
       [](const S& s) {
         return std::string(kOutOfRange.at(static_cast<std::size_t>(s.unit.settings.out_of_range)));
       }},
      Number<&M::voltage_v, 0, 600>("voltage_v"),
      Number<&M::power_factor, 0, 1>("power_factor"),
      {"speed_rpm", SetSpeed, [](const S& s) { return NumberText(s.unit.motor.SpeedAt(s.unit.now())); }},
      Number<&M::torque_nm, 0, 10'000>("torque_nm"),
      {"load_w", SetLoad, [](const S& s) { return NumberText(s.unit.motor.load_w(s.unit.now())); }},
      {"load_profile", SetProfile, [](const S& s) { return s.unit.motor.profile().Text(); }},
      Number<&M::run_up_w, 0, 6000>("run_up_w"),
      Number<&M::run_up_s, 0, 60>("run_up_s"),
      Number<&M::ambient_c, -50, 100>("ambient_c"),
      Number<&M::heating_c_per_w, 0, 10>("heating_c_per_w"),
      Number<&M::thermal_s, 0, 100'000>("thermal_s"),
      {"temperature_c", SetTemperature,
       [](const S& s) { return NumberText(s.unit.motor.At(s.unit.now()).temperature_c); }},
      Acceleration<0>("accel_x_mps2"),
      Acceleration<1>("accel_y_mps2"),
      Acceleration<2>("accel_z_mps2"),
      Number<&M::vibration_mps2, 0, 320>("vibration_mps2"),
      {"shock", SetShock, nullptr},
      {"trip", ForceTrip, nullptr},
      {"reset_trip", ResetTrip, nullptr},
      {"fault", SetFault, [](const S& s) { return UnitFaultText(s.fault); }},
      {"power", SetPower, [](const S& s) { return std::string(s.unit.powered() ? "on" : "off"); }},
  };
  return kTable;
}

constexpr std::array<std::string_view, 7> kInstantaneous = {"voltage", "current", "power",  "temperature",
                                                            "accel_x", "accel_y", "accel_z"};

std::string MotorText(const ScUnit& unit) {
  if (unit.motor.running()) return "running";
  return unit.motor_status() != 0 ? "tripped" : "stopped";
}

}  // namespace

std::string ParseUnitFault(std::string_view text, UnitFault& fault) {
  const std::size_t colon = text.find(':');
  std::string name(text.substr(0, colon));
  std::replace(name.begin(), name.end(), '-', '_');
  UnitFault parsed;
  const bool wrong_address = name == "wrong_address";
  if (wrong_address || name == "exception") {
    double amount = wrong_address ? kUsualWrongAddress : kUsualException;
    if (colon != std::string_view::npos) {
      std::string problem = ReadNumber(text.substr(colon + 1), 1, 255, "", amount);
      if (!problem.empty()) return problem;
    }
    (wrong_address ? parsed.wrong_address : parsed.exception) = static_cast<std::uint8_t>(amount);
  } else if (std::string problem = ParseFault(text, parsed.line); !problem.empty()) {
    return problem + ", wrong_address, exception";
  }
  fault = parsed;
  return {};
}

std::string UnitFaultText(const UnitFault& fault) {
  if (fault.wrong_address != 0) return "wrong_address:" + std::to_string(fault.wrong_address);
  if (fault.exception != 0) return "exception:" + std::to_string(fault.exception);
  return FaultText(fault.line);
}

const std::vector<std::string_view>& QuantityNames() {
  static const std::vector<std::string_view> kNames = NamesOf(Table());
  return kNames;
}

Result<> SimulatedUnit::Set(std::string_view name, std::string_view value) {
  return SetByName(Table(), *this, name, value);
}

std::vector<std::pair<std::string, std::string>> Quantities(const SimulatedUnit& simulated) {
  std::vector<std::pair<std::string, std::string>> list = Shown(Table(), simulated);
  AddReport(simulated.unit, list);
  return list;
}

void AddReport(const ScUnit& unit, std::vector<std::pair<std::string, std::string>>& list) {
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  std::uint16_t address = 100;
  for (const std::string_view name : kInstantaneous) {
    const std::uint16_t value = unit.InputRegister(address);
    const bool is_signed = address >= 100 + kTemperatureIndex;
    count("register_" + std::string(name), is_signed ? static_cast<std::int16_t>(value) : value);
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
}

}  // namespace axlecast::tsubaki_sc::simulator
