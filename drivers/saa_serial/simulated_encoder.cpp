#include "drivers/saa_serial/simulated_encoder.h"

#include <algorithm>
#include <cmath>

#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft.h"

namespace axlecast::saa_serial {

// What can be set of an encoder.
struct EncoderQuantities {
  using E = SimulatedEncoder;
  using Text = std::string_view;

  static const QuantityTable<E>& Table();

  static std::string Choose(Text value, Text no, Text yes, bool& into) {
    if (value != no && value != yes) {
      return "'" + std::string(value) + "' is neither " + std::string(no) + " nor " + std::string(yes);
    }
    into = value == yes;
    return {};
  }
  static std::string SetNoise(E& e, Text value) {
    double counts = 0;
    std::string problem = ReadNumber(value, 0, 1'000, "counts", counts);
    if (problem.empty()) e.noise_counts_ = std::floor(counts);
    return problem;
  }
  static std::string SetFault(E& e, Text value) {
    std::string problem = ParseFault(value, e.fault_);
    e.stuck_at_ = e.shaft_.At(e.now_).angle;
    return problem;
  }
};

const QuantityTable<SimulatedEncoder>& EncoderQuantities::Table() {
  static const auto kWord = [](bool is, Text no, Text yes) { return std::string(is ? yes : no); };
  static const QuantityTable<E> kTable = {
      {"pace", [](E& e, Text v) { return Choose(v, "wire", "unpaced", e.unpaced_); },
       [](const E& e) { return kWord(e.unpaced_, "wire", "unpaced"); }},
      {"reply_header", [](E& e, Text v) { return Choose(v, "81", "address", e.says_address_); },
       [](const E& e) { return kWord(e.says_address_, "81", "address"); }},
      {"processing_us", [](E& e, Text v) { return ReadNumber(v, 0, 1e6, "us", e.processing_us_); },
       [](const E& e) { return NumberText(e.processing_us_); }},
      {"refresh_hz", [](E& e, Text v) { return ReadNumber(v, 0, 50'000, "Hz (0: as configured)", e.refresh_hz_); },
       [](const E& e) { return NumberText(e.refresh_hz_); }},
      {"noise_counts", SetNoise, [](const E& e) { return NumberText(e.noise_counts_); }},
      {"zero_error_deg", [](E& e, Text v) { return ReadNumber(v, -10, 10, "deg", e.zero_error_deg_); },
       [](const E& e) { return NumberText(e.zero_error_deg_); }},
      {"accel_rad_s2", [](E& e, Text v) { return OrderAcceleration(e.shaft_, v); },
       [](const E& e) { return NumberText(e.shaft_.acceleration_rad_s2()); }},
      {"motion", [](E& e, Text v) { return OrderMotion(e.shaft_, v, e.now_, e.motion_); },
       [](const E& e) { return e.motion_; }},
      {"speed_rpm", [](E& e, Text v) { return OrderSpeed(e.shaft_, v, e.now_, e.motion_); },
       [](const E& e) { return NumberText(e.shaft_.At(e.now_).speed_rpm); }},
      {"fault", SetFault, [](const E& e) { return FaultText(e.fault_); }},
      {"power", [](E& e, Text v) { return Choose(v, "off", "on", e.powered_); },
       [](const E& e) { return kWord(e.powered_, "off", "on"); }},
  };
  return kTable;
}

const std::vector<std::string_view>& SimulatedEncoder::QuantityNames() {
  static const std::vector<std::string_view> kNames = NamesOf(EncoderQuantities::Table());
  return kNames;
}

Result<> SimulatedEncoder::Set(std::string_view name, std::string_view value) {
  return SetByName(EncoderQuantities::Table(), *this, name, value);
}

std::vector<std::pair<std::string, std::string>> SimulatedEncoder::Quantities() const {
  std::vector<std::pair<std::string, std::string>> list = Shown(EncoderQuantities::Table(), *this);
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
