#include "drivers/tformat/simulated_axis.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "drivers/kit/simulation/quantity_table.h"
#include "drivers/kit/simulation/quantity_text.h"
#include "drivers/kit/simulation/shaft_motion.h"

namespace axlecast::tformat {
namespace {

constexpr double kMaxVolts = 4.75;  // spec 5.3

using Text = std::string_view;

std::string NoneOf(Text value, std::initializer_list<Text> words) {
  std::string list;
  for (const Text word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return "'" + std::string(value) + "' is none of " + list;
}

std::string SetPower(SimulatedAxis& axis, Text value) {
  const MonoNs now = axis.encoder.now();
  if (value == "cycle") axis.encoder.SetPower(false, now);
  if (value == "on" || value == "cycle") {
    axis.encoder.SetPower(true, now);
  } else if (value == "off") {
    axis.encoder.SetPower(false, now);
  } else {
    return NoneOf(value, {"on", "off", "cycle"});
  }
  return {};
}

std::string SetBattery(SimulatedAxis& axis, Text value) {
  double volts = 0;
  std::string problem = ReadNumber(value, 0, kMaxVolts, "V (0: no battery)", volts);
  if (problem.empty()) axis.encoder.SetBattery(volts, axis.encoder.now());
  return problem;
}

std::string SetCountingError(SimulatedAxis& axis, Text value) {
  using Error = EncoderModel::CountingError;
  Error error = Error::kNone;
  if (value == "live") {
    error = Error::kLive;
  } else if (value == "latched") {
    error = Error::kLatched;
  } else if (value != "none") {
    return NoneOf(value, {"none", "live", "latched"});
  }
  axis.encoder.SetCountingError(error, axis.encoder.now());
  return {};
}

std::string ReadWhole(Text value, double min, double max, Text unit, std::int64_t& into) {
  double number = 0;
  std::string problem = ReadNumber(value, min, max, unit, number);
  if (problem.empty() && number != std::floor(number)) return "'" + std::string(value) + "' is not a whole number";
  if (problem.empty()) into = static_cast<std::int64_t>(number);
  return problem;
}

std::string SetJump(SimulatedAxis& axis, Text value) {
  std::int64_t turns = 0;
  std::string problem = ReadWhole(value, -65'535, 65'535, "turns", turns);
  if (problem.empty() && turns != 0) axis.encoder.JumpTurns(turns, axis.encoder.now());
  return problem;
}

std::string SetEncoderId(SimulatedAxis& axis, Text value) {
  std::uint8_t id = 0;
  const bool hex = value.starts_with("0x");
  const Text digits = hex ? value.substr(2) : value;
  const char* const end = digits.data() + digits.size();
  const auto [stopped, error] = std::from_chars(digits.data(), end, id, hex ? 16 : 10);
  if (error != std::errc() || stopped != end) return "'" + std::string(value) + "' is not 0 to 255 or 0x00 to 0xff";
  axis.encoder.settings().encoder_id = id;
  return {};
}

std::string SetNoise(SimulatedAxis& axis, Text value) {
  return ReadWhole(value, 0, 1000, "counts", axis.encoder.settings().noise_counts);
}

std::string SetZeroError(SimulatedAxis& axis, Text value) {
  return ReadNumber(value, -10, 10, "deg (the maker allows 0.35)", axis.encoder.settings().zero_error_deg);
}

std::optional<std::uint8_t> HexByte(Text text) {
  std::uint8_t byte = 0;
  const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), byte, 16);
  if (text.size() != 2 || error != std::errc() || stopped != text.data() + text.size()) return std::nullopt;
  return byte;
}

// "72=A1 05": bytes in hex from a cell on.
std::string SetEeprom(SimulatedAxis& axis, Text value) {
  std::string problem = "'" + std::string(value) + "' is not CELL=BYTES with cells 0 to 79, e.g. 72=A1 05";
  const std::size_t equals = value.find('=');
  std::int64_t cell = 0;
  if (equals == Text::npos || !ReadWhole(value.substr(0, equals), 0, 79, "", cell).empty()) return problem;
  std::vector<std::uint8_t> bytes;
  for (std::size_t at = equals + 1; at < value.size(); at += 3) {
    const std::optional<std::uint8_t> byte = HexByte(value.substr(at, 2));
    const bool separated = at + 2 >= value.size() || (value[at + 2] == ' ' && at + 3 < value.size());
    if (!byte || !separated) return problem;
    bytes.push_back(*byte);
  }
  const auto first = static_cast<std::size_t>(cell);
  if (bytes.empty() || first + bytes.size() > EncoderEeprom::kCells) return problem;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    axis.encoder.eeprom().Preset(static_cast<std::uint8_t>(first + i), bytes[i]);
  }
  return {};
}

std::string SetWear(SimulatedAxis& axis, Text value) {
  std::int64_t writes = 0;
  std::string problem = ReadWhole(value, 0, 1e9, "writes", writes);
  if (problem.empty()) axis.encoder.eeprom().SetWear(writes);
  return problem;
}

std::string SetFault(SimulatedAxis& axis, Text value) {
  std::string problem = ParseFault(value, axis.fault);
  if (problem.empty()) {
    axis.encoder.SetStuck(axis.fault.kind == SimulatedFault::Kind::kStuck, axis.encoder.now());
  }
  return problem;
}

constexpr std::array<Text, 3> kPaces = {"unpaced", "wire", "slots"};

std::string SetPace(SimulatedAxis& axis, Text value) {
  const auto* found = std::find(kPaces.begin(), kPaces.end(), value);
  if (found == kPaces.end()) return NoneOf(value, {kPaces[0], kPaces[1], kPaces[2]});
  axis.pace = static_cast<Pace>(found - kPaces.begin());
  return {};
}

std::string SetSlot(SimulatedAxis& axis, Text value) { return ReadNumber(value, 1, 1e6, "us", axis.slot_us); }

std::string SetAbnormalEcho(SimulatedAxis& axis, Text value) {
  if (value != "id3" && value != "request") return NoneOf(value, {"id3", "request"});
  axis.abnormal_echo = value == "request";
  return {};
}

using Quantity = SimulatedQuantity<SimulatedAxis>;

double Speed(const SimulatedAxis& axis) { return axis.encoder.shaft().At(axis.encoder.now()).speed_rpm; }

std::string CountingErrorText(const SimulatedAxis& axis) {
  constexpr std::array<Text, 3> kNames = {"none", "live", "latched"};
  return std::string(kNames.at(static_cast<std::size_t>(axis.encoder.counting_error())));
}

// The cells that hold something, as SetEeprom takes them when they stand in one row.
std::string EepromText(const SimulatedAxis& axis) {
  constexpr Text kDigits = "0123456789ABCDEF";
  std::string text;
  std::uint8_t next = EncoderEeprom::kCells;
  for (std::uint8_t cell = 0; cell < EncoderEeprom::kCells; ++cell) {
    const std::uint8_t byte = axis.encoder.eeprom().Read(cell);
    if (byte == 0) continue;
    if (cell != next) text += (text.empty() ? "" : ", ") + std::to_string(cell) + '=';
    if (cell == next) text += ' ';
    text += {kDigits[byte >> 4U], kDigits[byte & 0xFU]};
    next = static_cast<std::uint8_t>(cell + 1);
  }
  return text;
}

// Power and motion come last: the rest of the mapping holds when they begin.
const QuantityTable<SimulatedAxis>& Table() {
  using A = SimulatedAxis;
  static const QuantityTable<SimulatedAxis> kTable = {
      {"pace", SetPace, [](const A& a) { return std::string(kPaces.at(static_cast<std::size_t>(a.pace))); }},
      {"slot_us", SetSlot, [](const A& a) { return NumberText(a.slot_us); }},
      {"enid", SetEncoderId, [](const A& a) { return std::to_string(a.encoder.settings().encoder_id); }},
      {"abnormal_echo", SetAbnormalEcho,
       [](const A& a) { return std::string(a.abnormal_echo ? "request" : "id3"); }},
      {"noise_counts", SetNoise, [](const A& a) { return std::to_string(a.encoder.settings().noise_counts); }},
      {"zero_error_deg", SetZeroError, [](const A& a) { return NumberText(a.encoder.settings().zero_error_deg); }},
      {"eeprom", SetEeprom, EepromText},
      {"eeprom_wear", SetWear, [](const A& a) { return std::to_string(a.encoder.eeprom().wear()); }},
      {"battery_v", SetBattery, [](const A& a) { return NumberText(a.encoder.battery_volts()); }},
      {"counting_error", SetCountingError, CountingErrorText},
      {"multi_turn_jump", SetJump, [](const A& a) { return std::to_string(a.encoder.turns_jumped()); }},
      {"accel_rad_s2", [](A& a, Text v) { return OrderAcceleration(a.encoder.BusSlot(a.encoder.now()), v); },
       [](const A& a) { return NumberText(a.encoder.shaft().acceleration_rad_s2()); }},
      {"motion",
       [](A& a, Text v) { return OrderMotion(a.encoder.BusSlot(a.encoder.now()), v, a.encoder.now(), a.motion); },
       [](const A& a) { return a.motion; }},
      {"speed_rpm",
       [](A& a, Text v) { return OrderSpeed(a.encoder.BusSlot(a.encoder.now()), v, a.encoder.now(), a.motion); },
       [](const A& a) { return NumberText(Speed(a)); }},
      {"fault", SetFault, [](const A& a) { return FaultText(a.fault); }},
      {"power", SetPower, [](const A& a) { return std::string(a.encoder.powered() ? "on" : "off"); }},
  };
  return kTable;
}

std::string AlarmText(const EncoderModel::Reading& reading) {
  const std::array<std::pair<bool, Text>, 7> flags = {{{reading.over_speed, "OS"},
                                                       {reading.full_absolute, "FS"},
                                                       {reading.counting_error, "CE"},
                                                       {reading.counter_overflow, "OF"},
                                                       {reading.multi_turn_error, "ME"},
                                                       {reading.battery_error, "BE"},
                                                       {reading.battery_alarm, "BA"}}};
  std::string text;
  for (const auto& [raised, name] : flags) {
    if (raised) text += (text.empty() ? "" : " ") + std::string(name);
  }
  return text.empty() ? "none" : text;
}

}  // namespace

const std::vector<std::string_view>& QuantityNames() {
  static const std::vector<std::string_view> kNames = NamesOf(Table());
  return kNames;
}

std::string SimulatedAxis::Set(std::string_view name, std::string_view value) {
  return SetByName(Table(), *this, name, value);
}

std::vector<std::pair<std::string, std::string>> Quantities(const SimulatedAxis& axis) {
  std::vector<std::pair<std::string, std::string>> list = Shown(Table(), axis);

  EncoderModel encoder = axis.encoder;  // looking must not draw from its random numbers
  const EncoderModel::Reading reading = encoder.Read(encoder.now());
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(encoder.shaft().At(encoder.now()).angle)));
  count("single_turn", reading.single_turn);
  count("multi_turn", reading.multi_turn);
  list.emplace_back("alarms", AlarmText(reading));
  count("zeroings", encoder.effects().zeroings);
  count("refused_zeroings", encoder.effects().refused_zeroings);
  count("turn_resets", encoder.effects().turn_resets);
  count("error_clears", encoder.effects().error_clears);
  count("resets_counted", encoder.reset_counter().count());
  count("resets_broken", encoder.reset_counter().broken());
  count("resets_too_early", encoder.reset_counter().too_early());
  count("eeprom_writes", encoder.eeprom().writes_done());
  count("eeprom_writes_lost", encoder.eeprom().writes_lost());
  return list;
}

}  // namespace axlecast::tformat
