#include "drivers/biss/simulated_encoder.h"

#include <cmath>
#include <string>

namespace axlecast::biss {

const QuantityTable<SimulatedEncoder>& SimulatedEncoder::Table() {
  using E = SimulatedEncoder;
  static const QuantityTable<E> kTable = {
      NumberQuantity<E>("line_delay_ns", &E::line_delay_ns_, 0, 100'000, "ns"),
      NumberQuantity<E>("byte_gap_us", &E::byte_gap_us_, 0, 1'000, "us"),
      NumberQuantity<E>("timeout_us", &E::timeout_us_, 1, 1'000, "us"),
      NumberQuantity<E>("busy_us", &E::busy_us_, 0, 10'000, "us"),
      WholeQuantity<E>("busy_clocks", &E::busy_clocks_, 1, 1'000, "clocks"),
      ChoiceQuantity<E>("error", &E::error_, {"off", "on"}),
      ChoiceQuantity<E>("warning", &E::warning_, {"off", "on"}),
      ChoiceQuantity<E>("cds", &E::cds_, {"off", "on"}),
      ChoiceQuantity<E>("wiring", &E::wiring_, {"good", "open", "shorted", "swapped"}),
      WholeQuantity<E>("noise_counts", &E::noise_counts_, 0, 1'000, "counts"),
      AccelerationQuantity<E>(&E::shaft_),
      MotionQuantity<E>(&E::shaft_, &E::now_),
      SpeedQuantity<E>(&E::shaft_, &E::now_),
      {"fault", [](E& e, std::string_view text) { return e.SetFault(text); },
       [](const E& e) { return FaultText(e.fault_); }},
      ChoiceQuantity<E>("power", &E::powered_, {"off", "on"}),
  };
  return kTable;
}

Result<> SimulatedEncoder::SetFault(std::string_view text) {
  using Kind = SimulatedFault::Kind;
  const Result<SimulatedFault> fault = ParseFault(text);
  if (!fault) return Failure(fault.error());
  if (fault->kind == Kind::kRequestFlip || fault->kind == Kind::kDelayed || fault->kind == Kind::kLate ||
      fault->kind == Kind::kScattered || fault->kind == Kind::kEcho) {
    return Failure("'" + std::string(text) +
                   "' has no meaning here: the encoder is asked by its clock, and answers with it");
  }
  fault_ = *fault;
  stuck_at_ = shaft_.At(now_).angle;
  return {};
}

QuantityList SimulatedEncoder::Quantities() const {
  QuantityList list = ShownQuantities();
  const ShaftAngle angle = shaft_.At(now_).angle;
  const Latched latched = At(angle);
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(angle)));
  list.emplace_back("single_turn", std::to_string(latched.position));
  if (turn_bits_ > 0) list.emplace_back("multi_turn", std::to_string(latched.turns));
  return list;
}

SimulatedEncoder::Latched SimulatedEncoder::At(ShaftAngle angle) const {
  const auto in_turn = static_cast<std::uint64_t>(angle & (kShaftTurn - 1));
  // The shaft is known to 2^-30 turn; finer bits are 0.
  const auto position = bits_ <= kTurnBits ? in_turn >> static_cast<unsigned>(kTurnBits - bits_)
                                           : in_turn << static_cast<unsigned>(bits_ - kTurnBits);
  const auto turns = static_cast<std::uint64_t>(angle >> static_cast<unsigned>(kTurnBits));
  return {position, turns & ((std::uint64_t{1} << static_cast<unsigned>(turn_bits_)) - 1)};
}

SimulatedEncoder::Latched SimulatedEncoder::Latch(MonoNs at) {
  const bool stuck = fault_.kind == SimulatedFault::Kind::kStuck;
  ShaftAngle angle = stuck ? stuck_at_ : shaft_.At(at).angle;
  const auto noise = static_cast<std::int64_t>(noise_counts_);
  if (noise > 0) {
    const std::int64_t shift = random_.Around(noise);
    angle += bits_ <= kTurnBits ? shift * (std::int64_t{1} << static_cast<unsigned>(kTurnBits - bits_))
                                : shift / (std::int64_t{1} << static_cast<unsigned>(bits_ - kTurnBits));
  }
  return At(angle);
}

MonoNs SimulatedEncoder::line_delay() const { return std::llround(line_delay_ns_); }
MonoNs SimulatedEncoder::byte_gap() const { return std::llround(byte_gap_us_ * 1e3); }
MonoNs SimulatedEncoder::timeout() const { return std::llround(timeout_us_ * 1e3); }
MonoNs SimulatedEncoder::busy() const {
  const double slow_us = fault_.kind == SimulatedFault::Kind::kSlow ? fault_.amount : 0;
  return std::llround((busy_us_ + slow_us) * 1e3);
}

}  // namespace axlecast::biss
