#include "drivers/saa_modbus/simulated_encoder.h"

#include <array>
#include <string>

namespace axlecast::saa_modbus {
namespace {

using Encoder = SimulatedEncoder;

Result<> SetBaud(Encoder& encoder, std::string_view text) {
  constexpr std::array<std::string_view, 5> kWords = {"2400", "4800", "9600", "19200", "57600"};
  constexpr std::array<std::int64_t, kWords.size()> kRates = {2'400, 4'800, 9'600, 19'200, 57'600};
  const Result<std::size_t> rate = ParseChoice(text, kWords);
  if (!rate) return Failure(rate.error());
  encoder.baud = kRates.at(*rate);
  return {};
}

Result<> SetZeroAngle(Encoder& encoder, std::string_view text) {
  const Result<double> degrees = ParseNumber(text, 0, 360, "deg");
  if (!degrees) return Failure(degrees.error());
  encoder.zero = AngleFromDegrees(*degrees);
  return {};
}

Result<> SetFault(Encoder& encoder, std::string_view text) {
  const Result<SimulatedFault> fault = ParseFault(text);
  if (!fault) return Failure(fault.error());
  encoder.fault = *fault;
  encoder.stuck_at = encoder.shaft.At(encoder.now).angle;
  return {};
}

}  // namespace

// Power and motion come last: they begin after the rest of the mapping is set.
const QuantityTable<SimulatedEncoder>& SimulatedEncoder::Table() {
  using E = SimulatedEncoder;
  static const QuantityTable<E> kTable = {
      WholeQuantity<E>("address", &E::address, 1, 247, ""),
      {"baud", SetBaud, [](const E& e) { return std::to_string(e.baud); }},
      ChoiceQuantity<E>("counting", &E::negative, {"positive", "negative"}),
      {"zero_deg", SetZeroAngle, [](const E& e) { return NumberText(DegreesFromAngle(e.zero)); }},
      WholeQuantity<E>("noise_counts", &E::noise_counts, 0, 1'000, "counts"),
      NumberQuantity<E>("reply_us", &E::reply_us, 0, 1e6, "us"),
      ChoiceQuantity<E>("query_crc", &E::query_crc_lsb, {"msb_first", "lsb_first"}),
      ChoiceQuantity<E>("two_points", &E::two_points, {"padded", "ignored"}),
      ChoiceQuantity<E>("baud_reply", &E::baud_reply, {"old", "new"}),
      AccelerationQuantity<E>(&E::shaft),
      MotionQuantity<E>(&E::shaft, &E::now),
      SpeedQuantity<E>(&E::shaft, &E::now),
      {"fault", SetFault, [](const E& e) { return FaultText(e.fault); }},
      ChoiceQuantity<E>("power", &E::powered, {"off", "on"}),
  };
  return kTable;
}

std::uint32_t SimulatedEncoder::Position() {
  const bool stuck = fault.kind == SimulatedFault::Kind::kStuck;
  const ShaftAngle angle = (stuck ? stuck_at : shaft.At(now).angle) - zero;
  const auto within_turn = static_cast<std::uint64_t>(negative ? -angle : angle) & (kShaftTurn - 1);
  const auto counts = static_cast<std::int64_t>(within_turn >> static_cast<unsigned>(kTurnBits - bits));
  const std::int64_t noise = noise_counts > 0 ? random.Around(noise_counts) : 0;
  return static_cast<std::uint32_t>((counts + noise) & ((std::int64_t{1} << bits) - 1));
}

QuantityList SimulatedEncoder::Quantities() const {
  QuantityList list = ShownQuantities();
  SimulatedEncoder copy = *this;  // a look must not draw from the random numbers
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(shaft.At(now).angle)));
  list.emplace_back("single_turn", std::to_string(copy.Position()));
  list.emplace_back("writes", std::to_string(writes));
  return list;
}

}  // namespace axlecast::saa_modbus
