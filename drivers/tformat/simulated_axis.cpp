#include "drivers/tformat/simulator.h"

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kit/arguments.h"
#include "drivers/kit/simulation/quantity.h"

namespace axlecast::tformat {
namespace {

constexpr double kMaxVolts = 4.75;  // spec 5.3

using Text = std::string_view;

Result<> SetPower(SimulatedAxis& axis, Text value) {
  constexpr std::array<Text, 3> kWords = {"on", "off", "cycle"};
  const Result<std::size_t> word = ParseChoice(value, kWords);
  if (!word) return Failure(word.error());
  const MonoNs now = axis.encoder.now();
  if (value != "on") axis.encoder.SetPower(false, now);
  if (value != "off") axis.encoder.SetPower(true, now);
  return {};
}

Result<> SetBattery(SimulatedAxis& axis, Text value) {
  const Result<double> volts = ParseNumber(value, 0, kMaxVolts, "V (0: no battery)");
  if (!volts) return Failure(volts.error());
  axis.encoder.SetBattery(*volts, axis.encoder.now());
  return {};
}

constexpr std::array<Text, 3> kCountingErrors = {"none", "live", "latched"};

Result<> SetCountingError(SimulatedAxis& axis, Text value) {
  const Result<std::size_t> error = ParseChoice(value, kCountingErrors);
  if (!error) return Failure(error.error());
  axis.encoder.SetCountingError(static_cast<EncoderModel::CountingError>(*error), axis.encoder.now());
  return {};
}

Result<> SetJump(SimulatedAxis& axis, Text value) {
  const Result<std::int64_t> turns = ParseWholeNumber(value, -65'535, 65'535, "turns");
  if (!turns) return Failure(turns.error());
  if (*turns != 0) axis.encoder.JumpTurns(*turns, axis.encoder.now());
  return {};
}

Result<> SetEncoderId(SimulatedAxis& axis, Text value) {
  const std::optional<std::int64_t> id = ParseWhole(value, 0, 0xFF);
  if (!id) return Failure("'" + std::string(value) + "' is not 0 to 255 or 0x00 to 0xff");
  axis.encoder.settings().encoder_id = static_cast<std::uint8_t>(*id);
  return {};
}

// "72=A1 05": bytes in hex from a cell on.
Result<> SetEeprom(SimulatedAxis& axis, Text value) {
  const std::size_t equals = value.find('=');
  const auto cell = ParseWhole(value.substr(0, equals), 0, EncoderEeprom::kCells - 1);
  const auto bytes = ParseHex(equals == Text::npos ? Text() : value.substr(equals + 1));
  if (!cell || !bytes || static_cast<std::size_t>(*cell) + bytes->size() > EncoderEeprom::kCells) {
    return Failure("'" + std::string(value) + "' is not CELL=BYTES with cells 0 to 79, e.g. 72=A1 05");
  }
  auto at = static_cast<std::uint8_t>(*cell);
  for (const std::uint8_t byte : *bytes) axis.encoder.eeprom().Preset(at++, byte);
  return {};
}

Result<> SetWear(SimulatedAxis& axis, Text value) {
  const Result<std::int64_t> writes = ParseWholeNumber(value, 0, 1e9, "writes");
  if (!writes) return Failure(writes.error());
  axis.encoder.eeprom().SetWear(*writes);
  return {};
}

Result<> SetFault(SimulatedAxis& axis, Text value) {
  const Result<SimulatedFault> fault = ParseFault(value);
  if (!fault) return Failure(fault.error());
  axis.fault = *fault;
  axis.encoder.SetStuck(fault->kind == SimulatedFault::Kind::kStuck, axis.encoder.now());
  return {};
}

// The cells that hold something, as SetEeprom takes them if they are in one row.
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

// Power and motion come last: they begin after the rest of the mapping is set.
const QuantityTable<SimulatedAxis>& SimulatedAxis::Table() {
  using A = SimulatedAxis;
  constexpr auto kSettings = [](auto& a) -> auto& { return a.encoder.settings(); };
  static const QuantityTable<A> kTable = {
      ChoiceQuantity<A>("pace", &A::pace, {"unpaced", "wire", "slots"}),
      NumberQuantity<A>("slot_us", &A::slot_us, 1, 1e6, "us"),
      {"enid", SetEncoderId, [](const A& a) { return std::to_string(a.encoder.settings().encoder_id); }},
      ChoiceQuantity<A>("abnormal_echo", &A::abnormal_echo, {"id3", "request"}),
      WholeQuantity<A>(
          "noise_counts", [=](auto& a) -> auto& { return kSettings(a).noise_counts; }, 0, 1000, "counts"),
      NumberQuantity<A>(
          "zero_error_deg", [=](auto& a) -> auto& { return kSettings(a).zero_error_deg; }, -10, 10,
          "deg (the maker allows 0.35)"),
      {"eeprom", SetEeprom, EepromText},
      {"eeprom_wear", SetWear, [](const A& a) { return std::to_string(a.encoder.eeprom().wear()); }},
      {"battery_v", SetBattery, [](const A& a) { return NumberText(a.encoder.battery_volts()); }},
      {"counting_error", SetCountingError,
       [](const A& a) {
         return std::string(kCountingErrors.at(static_cast<std::size_t>(a.encoder.counting_error())));
       }},
      {"multi_turn_jump", SetJump, [](const A& a) { return std::to_string(a.encoder.turns_jumped()); }},
      {"accel_rad_s2", [](A& a, Text v) { return a.encoder.ShaftToTurn(a.encoder.now()).SetAcceleration(v); },
       [](const A& a) { return NumberText(a.encoder.shaft().acceleration_rad_s2()); }},
      {"motion", [](A& a, Text v) { return a.encoder.ShaftToTurn(a.encoder.now()).SetMotion(v, a.encoder.now()); },
       [](const A& a) { return a.encoder.shaft().motion(); }},
      {"speed_rpm",
       [](A& a, Text v) { return a.encoder.ShaftToTurn(a.encoder.now()).SetSpeed(v, a.encoder.now()); },
       [](const A& a) { return NumberText(a.encoder.shaft().At(a.encoder.now()).speed_rpm); }},
      {"fault", SetFault, [](const A& a) { return FaultText(a.fault); }},
      {"power", SetPower, [](const A& a) { return std::string(a.encoder.powered() ? "on" : "off"); }},
  };
  return kTable;
}

QuantityList SimulatedAxis::Quantities() const {
  QuantityList list = ShownQuantities();
  EncoderModel copy = encoder;  // a look must not draw from its random numbers
  const EncoderModel::Reading reading = copy.Read(copy.now());
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
