#include "drivers/saa_modbus/simulator/simulated_encoder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft.h"

namespace axlecast::saa_modbus {
namespace {

using Encoder = SimulatedEncoder;
using Word = std::string_view;

constexpr double kMaxAddress = 247;
constexpr std::array<std::int64_t, 5> kRates = {2'400, 4'800, 9'600, 19'200, 57'600};

std::string NoneOf(Word value, std::initializer_list<Word> words) {
  std::string list;
  for (const Word word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return "'" + std::string(value) + "' is none of " + list;
}

// Sets `into` to the index of `value` among `words`.
std::string Choose(Word value, std::initializer_list<Word> words, std::size_t& into) {
  const auto* found = std::find(words.begin(), words.end(), value);
  if (found == words.end()) return NoneOf(value, words);
  into = static_cast<std::size_t>(found - words.begin());
  return {};
}

std::string ReadWhole(Word value, double min, double max, Word unit, std::int64_t& into) {
  double number = 0;
  std::string problem = ReadNumber(value, min, max, unit, number);
  if (problem.empty() && number != std::floor(number)) return "'" + std::string(value) + "' is not a whole number";
  if (problem.empty()) into = static_cast<std::int64_t>(number);
  return problem;
}

std::string SetAddress(Encoder& encoder, Word value) {
  std::int64_t address = 0;
  std::string problem = ReadWhole(value, 1, kMaxAddress, "", address);
  if (problem.empty()) encoder.address = static_cast<std::uint8_t>(address);
  return problem;
}

std::string SetBaud(Encoder& encoder, Word value) {
  std::int64_t baud = 0;
  std::string problem = ReadWhole(value, 1, 1e6, "Bd", baud);
  if (problem.empty() && std::find(kRates.begin(), kRates.end(), baud) == kRates.end()) {
    problem = NoneOf(value, {"2400", "4800", "9600", "19200", "57600"});
  }
  if (problem.empty()) encoder.baud = baud;
  return problem;
}

std::string SetDirection(Encoder& encoder, Word value) {
  std::size_t choice = 0;
  std::string problem = Choose(value, {"positive", "negative"}, choice);
  if (problem.empty()) encoder.negative = choice == 1;
  return problem;
}

std::string SetZeroAngle(Encoder& encoder, Word value) {
  double degrees = 0;
  std::string problem = ReadNumber(value, 0, 360, "deg", degrees);
  if (problem.empty()) encoder.zero = AngleFromDegrees(degrees);
  return problem;
}

std::string SetNoise(Encoder& encoder, Word value) {
  return ReadWhole(value, 0, 1000, "counts", encoder.noise_counts);
}

std::string SetReplyTime(Encoder& encoder, Word value) { return ReadNumber(value, 0, 1e6, "us", encoder.reply_us); }

std::string SetQueryCrc(Encoder& encoder, Word value) {
  std::size_t choice = 0;
  std::string problem = Choose(value, {"msb_first", "lsb_first"}, choice);
  if (problem.empty()) encoder.query_crc_lsb = choice == 1;
  return problem;
}

std::string SetTwoPoints(Encoder& encoder, Word value) {
  std::size_t choice = 0;
  std::string problem = Choose(value, {"padded", "ignored"}, choice);
  if (problem.empty()) encoder.two_points = static_cast<Encoder::TwoPoints>(choice);
  return problem;
}

std::string SetBaudReply(Encoder& encoder, Word value) {
  std::size_t choice = 0;
  std::string problem = Choose(value, {"old", "new"}, choice);
  if (problem.empty()) encoder.baud_reply = static_cast<Encoder::BaudReply>(choice);
  return problem;
}

std::string SetFault(Encoder& encoder, Word value) {
  std::string problem = ParseFault(value, encoder.fault);
  if (problem.empty()) encoder.stuck_at = encoder.shaft.At(encoder.now).angle;
  return problem;
}

std::string SetPower(Encoder& encoder, Word value) {
  std::size_t choice = 0;
  std::string problem = Choose(value, {"on", "off"}, choice);
  if (problem.empty()) encoder.powered = choice == 0;
  return problem;
}

std::string Whole(std::int64_t value) { return std::to_string(value); }
std::string Either(bool second, Word first_word, Word second_word) {
  return std::string(second ? second_word : first_word);
}

using Quantity = SimulatedQuantity<SimulatedEncoder>;

// Power and motion come last: the rest of the mapping holds when they begin.
const QuantityTable<SimulatedEncoder>& Table() {
  using E = SimulatedEncoder;
  static const QuantityTable<SimulatedEncoder> kTable = {
      {"address", SetAddress, [](const E& e) { return Whole(e.address); }},
      {"baud", SetBaud, [](const E& e) { return Whole(e.baud); }},
      {"counting", SetDirection, [](const E& e) { return Either(e.negative, "positive", "negative"); }},
      {"zero_deg", SetZeroAngle, [](const E& e) { return NumberText(DegreesFromAngle(e.zero)); }},
      {"noise_counts", SetNoise, [](const E& e) { return Whole(e.noise_counts); }},
      {"reply_us", SetReplyTime, [](const E& e) { return NumberText(e.reply_us); }},
      {"query_crc", SetQueryCrc, [](const E& e) { return Either(e.query_crc_lsb, "msb_first", "lsb_first"); }},
      {"two_points", SetTwoPoints,
       [](const E& e) { return Either(e.two_points == E::TwoPoints::kIgnored, "padded", "ignored"); }},
      {"baud_reply", SetBaudReply,
       [](const E& e) { return Either(e.baud_reply == E::BaudReply::kNew, "old", "new"); }},
      {"accel_rad_s2", [](E& e, Word v) { return OrderAcceleration(e.shaft, v); },
       [](const E& e) { return NumberText(e.shaft.acceleration_rad_s2()); }},
      {"motion", [](E& e, Word v) { return OrderMotion(e.shaft, v, e.now, e.motion); },
       [](const E& e) { return e.motion; }},
      {"speed_rpm", [](E& e, Word v) { return OrderSpeed(e.shaft, v, e.now, e.motion); },
       [](const E& e) { return NumberText(e.shaft.At(e.now).speed_rpm); }},
      {"fault", SetFault, [](const E& e) { return FaultText(e.fault); }},
      {"power", SetPower, [](const E& e) { return Either(!e.powered, "on", "off"); }},
  };
  return kTable;
}

}  // namespace

const std::vector<std::string_view>& QuantityNames() {
  static const std::vector<std::string_view> kNames = NamesOf(Table());
  return kNames;
}

Result<> SimulatedEncoder::Set(std::string_view name, std::string_view value) {
  return SetByName(Table(), *this, name, value);
}

std::uint32_t SimulatedEncoder::Position() {
  const bool stuck = fault.kind == SimulatedFault::Kind::kStuck;
  const ShaftAngle angle = (stuck ? stuck_at : shaft.At(now).angle) - zero;
  const auto within_turn = static_cast<std::uint64_t>(negative ? -angle : angle) & (kShaftTurn - 1);
  const auto counts = static_cast<std::int64_t>(within_turn >> static_cast<unsigned>(kTurnBits - bits));
  const std::int64_t noise = noise_counts > 0 ? random.Around(noise_counts) : 0;
  return static_cast<std::uint32_t>((counts + noise) & ((std::int64_t{1} << bits) - 1));
}

void SimulatedEncoder::SetZero() { zero = shaft.At(now).angle; }

std::vector<std::pair<std::string, std::string>> Quantities(const SimulatedEncoder& encoder) {
  std::vector<std::pair<std::string, std::string>> list = Shown(Table(), encoder);
  SimulatedEncoder copy = encoder;  // looking must not draw from its random numbers
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(encoder.shaft.At(encoder.now).angle)));
  list.emplace_back("single_turn", std::to_string(copy.Position()));
  list.emplace_back("writes", std::to_string(encoder.writes));
  return list;
}

}  // namespace axlecast::saa_modbus
