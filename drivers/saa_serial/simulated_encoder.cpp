#include "drivers/saa_serial/simulated_encoder.h"

#include <cmath>
#include <string>

namespace axlecast::saa_serial {

const QuantityTable<SimulatedEncoder>& SimulatedEncoder::Table() {
  using E = SimulatedEncoder;
  static const QuantityTable<E> kTable = {
      ChoiceQuantity<E>("pace", &E::unpaced_, {"wire", "unpaced"}),
      ChoiceQuantity<E>("reply_header", &E::sends_address_, {"81", "address"}),
      NumberQuantity<E>("processing_us", &E::processing_us_, 0, 1e6, "us"),
      NumberQuantity<E>("refresh_hz", &E::refresh_hz_, 0, 50'000, "Hz (0: as configured)"),
      WholeQuantity<E>("noise_counts", &E::noise_counts_, 0, 1'000, "counts"),
      NumberQuantity<E>("zero_error_deg", &E::zero_error_deg_, -10, 10, "deg"),
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
  const Result<SimulatedFault> fault = ParseFault(text);
  if (!fault) return Failure(fault.error());
  fault_ = *fault;
  stuck_at_ = shaft_.At(now_).angle;
  return {};
}

QuantityList SimulatedEncoder::Quantities() const {
  QuantityList list = ShownQuantities();
  const ShaftAngle angle = shaft_.At(now_).angle;
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(angle)));
  list.emplace_back("single_turn", std::to_string(CountsAt(angle)));
  list.emplace_back("zeroings", std::to_string(zeroings_));
  return list;
}

std::uint32_t SimulatedEncoder::CountsAt(ShaftAngle angle) const {
  const ShaftAngle turned = (angle - zero_) & (kShaftTurn - 1);
  return static_cast<std::uint32_t>(turned >> static_cast<unsigned>(kTurnBits - bits_));
}

std::uint32_t SimulatedEncoder::Sample(MonoNs at) {
  const bool stuck = fault_.kind == SimulatedFault::Kind::kStuck;
  const std::uint32_t counts = CountsAt(stuck ? stuck_at_ : shaft_.At(at).angle);
  const auto noise = static_cast<std::int64_t>(noise_counts_);
  const auto shift = static_cast<std::uint32_t>(noise == 0 ? 0 : random_.Around(noise));
  return (counts + shift) & ((1U << static_cast<unsigned>(bits_)) - 1);
}

void SimulatedEncoder::ClearToZero(MonoNs at) {
  zero_ = shaft_.At(at).angle - AngleFromDegrees(zero_error_deg_);
  ++zeroings_;
}

MonoNs SimulatedEncoder::processing() const {
  const double slow_us = fault_.kind == SimulatedFault::Kind::kSlow ? fault_.amount : 0;
  return std::llround((processing_us_ + slow_us) * 1e3);
}

}  // namespace axlecast::saa_serial
