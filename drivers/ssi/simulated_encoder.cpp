#include "drivers/ssi/simulated_encoder.h"

#include <algorithm>
#include <cmath>

namespace axlecast::ssi {

const QuantityTable<SimulatedEncoder>& SimulatedEncoder::Table() {
  using E = SimulatedEncoder;
  using Text = std::string_view;
  static const QuantityTable<E> kTable = {
      NumberQuantity<E>(
          "cable_m", [](auto& e) -> auto& { return e.properties_.cable_m; }, 0, 5'000, "m"),
      NumberQuantity<E>(
          "monoflop_us", [](auto& e) -> auto& { return e.properties_.monoflop_us; }, 0.1, 100'000, "us"),
      ChoiceQuantity<E>("after_word", [](auto& e) -> auto& { return e.properties_.after_word; },
                        {"zeros", "one_zero", "no_gap"}),
      NumberQuantity<E>("byte_gap_us", &E::byte_gap_us_, 0, 10'000, "us"),
      ChoiceQuantity<E>("data_line", &E::data_line_, {"encoder", "high", "low", "swapped"}),
      {"status", [](E& e, Text text) { return e.SetStatus(text); }, [](const E& e) { return e.StatusText(); }},
      WholeQuantity<E>("noise_counts", &E::noise_counts_, 0, 1'000, "counts"),
      AccelerationQuantity<E>(&E::shaft_),
      MotionQuantity<E>(&E::shaft_, &E::now_),
      SpeedQuantity<E>(&E::shaft_, &E::now_),
      {"fault", [](E& e, Text text) { return e.SetFault(text); }, [](const E& e) { return FaultText(e.fault_); }},
      ChoiceQuantity<E>("power", &E::powered_, {"off", "on"}),
  };
  return kTable;
}

// "none", or names of flags with blanks or commas between them.
Result<> SimulatedEncoder::SetStatus(std::string_view text) {
  const auto& flags = properties_.word.flags;
  std::uint32_t raised = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" ,", begin), text.size());
    const std::string_view name = text.substr(begin, end - begin);
    begin = end + 1;
    if (name.empty() || name == "none") continue;
    const auto flag =
        std::find_if(flags.begin(), flags.end(), [&](const auto& known) { return known.name == name; });
    if (flag == flags.end()) return Failure("'" + std::string(name) + "' is not one of its status_bits");
    raised |= 1U << static_cast<unsigned>(flag - flags.begin());
  }
  raised_ = raised;
  return {};
}

std::string SimulatedEncoder::StatusText() const {
  std::string text;
  for (std::size_t i = 0; i < properties_.word.flags.size(); ++i) {
    if ((raised_ >> i & 1) != 0) text += (text.empty() ? "" : " ") + properties_.word.flags[i].name;
  }
  return text.empty() ? "none" : text;
}

Result<> SimulatedEncoder::SetFault(std::string_view text) {
  using Kind = SimulatedFault::Kind;
  const Result<SimulatedFault> fault = ParseFault(text);
  if (!fault) return Failure(fault.error());
  if (fault->kind == Kind::kDelayed || fault->kind == Kind::kLate || fault->kind == Kind::kScattered) {
    return Failure("'" + std::string(text) +
                   "': nothing is held back on a line that the host clocks; for late data slow:US");
  }
  fault_ = *fault;
  stuck_at_ = shaft_.At(now_).angle;
  return {};
}

QuantityList SimulatedEncoder::Quantities() const {
  QuantityList list = ShownQuantities();
  const ShaftAngle angle = shaft_.At(now_).angle;
  const Place place = PlaceAt(angle);
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(angle)));
  list.emplace_back("single_turn", std::to_string(place.counts));
  if (properties_.word.turn_bits > 0) list.emplace_back("multi_turn", std::to_string(place.turns));
  return list;
}

SimulatedEncoder::Place SimulatedEncoder::PlaceAt(ShaftAngle angle) const {
  const SimulatedWord& word = properties_.word;
  // Resolutions finer than the simulated shaft's have zeros at their end.
  const ShaftAngle in_turn = angle & (kShaftTurn - 1);
  const int finer = word.bits - kTurnBits;
  const auto counts = static_cast<std::uint64_t>(finer >= 0 ? in_turn << finer : in_turn >> -finer);
  const auto turns = static_cast<std::uint64_t>(angle >> kTurnBits) & ((std::uint64_t{1} << word.turn_bits) - 1);
  return {static_cast<std::uint32_t>(turns), static_cast<std::uint32_t>(counts)};
}

Levels SimulatedEncoder::WordAt(MonoNs at) {
  const bool stuck = fault_.kind == SimulatedFault::Kind::kStuck;
  ShaftAngle angle = stuck ? stuck_at_ : shaft_.At(at).angle;
  const auto noise = static_cast<std::int64_t>(noise_counts_);
  if (noise > 0) angle += random_.Around(noise) * (kShaftTurn >> std::min(properties_.word.bits, kTurnBits));
  const Place place = PlaceAt(angle);
  return properties_.word.Make(place.turns, place.counts, raised_);
}

MonoNs SimulatedEncoder::monoflop() const { return std::llround(properties_.monoflop_us * 1e3); }

MonoNs SimulatedEncoder::delay() const {
  const double slow_ns = fault_.kind == SimulatedFault::Kind::kSlow ? fault_.amount * 1e3 : 0;
  return std::llround(properties_.electronics_ns + 2 * properties_.cable_ns_per_m * properties_.cable_m + slow_ns);
}

MonoNs SimulatedEncoder::byte_gap() const { return std::llround(byte_gap_us_ * 1e3); }

}  // namespace axlecast::ssi
