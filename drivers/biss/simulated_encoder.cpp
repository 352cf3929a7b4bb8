#include "drivers/biss/simulated_encoder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft.h"

namespace axlecast::biss {

// What can be set of an encoder and its line.
struct BissQuantities {
  using E = SimulatedEncoder;
  using Text = std::string_view;

  static const QuantityTable<E>& Table();

  static constexpr std::array<Text, 4> kWirings = {"good", "open", "shorted", "swapped"};

  static std::string OnOff(Text value, bool& into) {
    if (value != "on" && value != "off") return "'" + std::string(value) + "' is neither on nor off";
    into = value == "on";
    return {};
  }
  static std::string Word(bool on) { return on ? "on" : "off"; }

  static std::string SetWiring(E& e, Text value) {
    const auto* found = std::find(kWirings.begin(), kWirings.end(), value);
    if (found == kWirings.end()) {
      return "'" + std::string(value) + "' is no wiring: one of good, open, shorted, swapped";
    }
    e.wiring_ = static_cast<E::Wiring>(found - kWirings.begin());
    return {};
  }
  static std::string SetWhole(Text value, double min, double max, Text unit, double& into) {
    std::string problem = ReadNumber(value, min, max, unit, into);
    if (problem.empty()) into = std::floor(into);
    return problem;
  }
  static std::string SetFault(E& e, Text value) {
    SimulatedFault fault;
    std::string problem = ParseFault(value, fault);
    if (!problem.empty()) return problem;
    using Kind = SimulatedFault::Kind;
    if (fault.kind == Kind::kRequestFlip || fault.kind == Kind::kDelayed || fault.kind == Kind::kLate ||
        fault.kind == Kind::kScattered || fault.kind == Kind::kEcho) {
      return "'" + std::string(value) +
             "' has no meaning here: the encoder is asked by its clock, and answers with it";
    }
    e.fault_ = fault;
    e.stuck_at_ = e.shaft_.At(e.now_).angle;
    return {};
  }
};

const QuantityTable<SimulatedEncoder>& BissQuantities::Table() {
  static const QuantityTable<E> kTable = {
      {"line_delay_ns", [](E& e, Text v) { return ReadNumber(v, 0, 100'000, "ns", e.line_delay_ns_); },
       [](const E& e) { return NumberText(e.line_delay_ns_); }},
      {"byte_gap_us", [](E& e, Text v) { return ReadNumber(v, 0, 1'000, "us", e.byte_gap_us_); },
       [](const E& e) { return NumberText(e.byte_gap_us_); }},
      {"timeout_us", [](E& e, Text v) { return ReadNumber(v, 1, 1'000, "us", e.timeout_us_); },
       [](const E& e) { return NumberText(e.timeout_us_); }},
      {"busy_us", [](E& e, Text v) { return ReadNumber(v, 0, 10'000, "us", e.busy_us_); },
       [](const E& e) { return NumberText(e.busy_us_); }},
      {"busy_clocks", [](E& e, Text v) { return SetWhole(v, 1, 1'000, "clocks", e.busy_clocks_); },
       [](const E& e) { return NumberText(e.busy_clocks_); }},
      {"error", [](E& e, Text v) { return OnOff(v, e.error_); }, [](const E& e) { return Word(e.error_); }},
      {"warning", [](E& e, Text v) { return OnOff(v, e.warning_); }, [](const E& e) { return Word(e.warning_); }},
      {"cds", [](E& e, Text v) { return OnOff(v, e.cds_); }, [](const E& e) { return Word(e.cds_); }},
      {"wiring", SetWiring,
       [](const E& e) { return std::string(kWirings.at(static_cast<std::size_t>(e.wiring_))); }},
      {"noise_counts", [](E& e, Text v) { return SetWhole(v, 0, 1'000, "counts", e.noise_counts_); },
       [](const E& e) { return NumberText(e.noise_counts_); }},
      {"accel_rad_s2", [](E& e, Text v) { return OrderAcceleration(e.shaft_, v); },
       [](const E& e) { return NumberText(e.shaft_.acceleration_rad_s2()); }},
      {"motion", [](E& e, Text v) { return OrderMotion(e.shaft_, v, e.now_, e.motion_); },
       [](const E& e) { return e.motion_; }},
      {"speed_rpm", [](E& e, Text v) { return OrderSpeed(e.shaft_, v, e.now_, e.motion_); },
       [](const E& e) { return NumberText(e.shaft_.At(e.now_).speed_rpm); }},
      {"fault", SetFault, [](const E& e) { return FaultText(e.fault_); }},
      {"power", [](E& e, Text v) { return OnOff(v, e.powered_); }, [](const E& e) { return Word(e.powered_); }},
  };
  return kTable;
}

const std::vector<std::string_view>& SimulatedEncoder::QuantityNames() {
  static const std::vector<std::string_view> kNames = NamesOf(BissQuantities::Table());
  return kNames;
}

Result<> SimulatedEncoder::Set(std::string_view name, std::string_view value) {
  return SetByName(BissQuantities::Table(), *this, name, value);
}

std::vector<std::pair<std::string, std::string>> SimulatedEncoder::Quantities() const {
  std::vector<std::pair<std::string, std::string>> list = Shown(BissQuantities::Table(), *this);
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
