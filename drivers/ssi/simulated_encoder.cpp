#include "drivers/ssi/simulated_encoder.h"

#include <array>
#include <cmath>

#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft.h"

namespace axlecast::ssi {
namespace {

using Text = std::string_view;

template <std::size_t N>
std::string Choose(Text value, const std::array<Text, N>& words, std::size_t& into) {
  std::string list;
  for (std::size_t i = 0; i < N; ++i) {
    if (words[i] == value) {
      into = i;
      return {};
    }
    list += (i == 0 ? "" : ", ") + std::string(words[i]);
  }
  return "'" + std::string(value) + "' is none of " + list;
}

constexpr std::array<Text, 4> kDataLines = {"encoder", "high", "low", "swapped"};
constexpr std::array<Text, 3> kAfterWords = {"zeros", "one_zero", "no_gap"};
constexpr std::array<Text, 2> kPower = {"off", "on"};

}  // namespace

// What can be set of an encoder.
struct EncoderQuantities {
  using E = SimulatedEncoder;

  static const QuantityTable<E>& Table();

  static std::string SetAfterWord(E& e, Text value) {
    std::size_t chosen = 0;
    std::string problem = Choose(value, kAfterWords, chosen);
    if (problem.empty()) e.properties_.after_word = static_cast<SimulatedOutput::AfterWord>(chosen);
    return problem;
  }
  static std::string SetDataLine(E& e, Text value) {
    std::size_t chosen = 0;
    std::string problem = Choose(value, kDataLines, chosen);
    if (problem.empty()) e.data_line_ = static_cast<E::DataLine>(chosen);
    return problem;
  }
  static std::string SetPower(E& e, Text value) {
    std::size_t chosen = 0;
    std::string problem = Choose(value, kPower, chosen);
    if (problem.empty()) e.powered_ = chosen == 1;
    return problem;
  }
  // "none", or names with blanks or commas between them.
  static std::string SetStatus(E& e, Text value) {
    std::uint32_t raised = 0;
    for (std::size_t begin = 0; begin < value.size();) {
      const std::size_t end = std::min(value.find_first_of(" ,", begin), value.size());
      const Text name = value.substr(begin, end - begin);
      begin = end + 1;
      if (name.empty() || name == "none") continue;
      std::size_t flag = 0;
      const auto& flags = e.properties_.word.flags;
      while (flag < flags.size() && flags[flag].name != name) ++flag;
      if (flag == flags.size()) return "'" + std::string(name) + "' is none of its status_bits";
      raised |= 1U << flag;
    }
    e.raised_ = raised;
    return {};
  }
  static std::string StatusText(const E& e) {
    std::string text;
    for (std::size_t i = 0; i < e.properties_.word.flags.size(); ++i) {
      if ((e.raised_ >> i & 1) != 0) text += (text.empty() ? "" : " ") + e.properties_.word.flags[i].name;
    }
    return text.empty() ? "none" : text;
  }
  static std::string SetNoise(E& e, Text value) {
    double counts = 0;
    std::string problem = ReadNumber(value, 0, 1'000, "counts", counts);
    if (problem.empty()) e.noise_counts_ = std::floor(counts);
    return problem;
  }
  static std::string SetFault(E& e, Text value) {
    SimulatedFault fault;
    std::string problem = ParseFault(value, fault);
    if (!problem.empty()) return problem;
    using Kind = SimulatedFault::Kind;
    if (fault.kind == Kind::kDelayed || fault.kind == Kind::kLate || fault.kind == Kind::kScattered) {
      return "'" + std::string(value) +
             "': nothing is held back on a line that the host clocks; for late data slow:US";
    }
    e.fault_ = fault;
    e.stuck_at_ = e.shaft_.At(e.now_).angle;
    return {};
  }
};

const QuantityTable<SimulatedEncoder>& EncoderQuantities::Table() {
  static const QuantityTable<E> kTable = {
      {"cable_m", [](E& e, Text v) { return ReadNumber(v, 0, 5'000, "m", e.properties_.cable_m); },
       [](const E& e) { return NumberText(e.properties_.cable_m); }},
      {"monoflop_us", [](E& e, Text v) { return ReadNumber(v, 0.1, 100'000, "us", e.properties_.monoflop_us); },
       [](const E& e) { return NumberText(e.properties_.monoflop_us); }},
      {"after_word", SetAfterWord,
       [](const E& e) { return std::string(kAfterWords.at(static_cast<std::size_t>(e.properties_.after_word))); }},
      {"byte_gap_us", [](E& e, Text v) { return ReadNumber(v, 0, 10'000, "us", e.byte_gap_us_); },
       [](const E& e) { return NumberText(e.byte_gap_us_); }},
      {"data_line", SetDataLine,
       [](const E& e) { return std::string(kDataLines.at(static_cast<std::size_t>(e.data_line_))); }},
      {"status", SetStatus, StatusText},
      {"noise_counts", SetNoise, [](const E& e) { return NumberText(e.noise_counts_); }},
      {"accel_rad_s2", [](E& e, Text v) { return OrderAcceleration(e.shaft_, v); },
       [](const E& e) { return NumberText(e.shaft_.acceleration_rad_s2()); }},
      {"motion", [](E& e, Text v) { return OrderMotion(e.shaft_, v, e.now_, e.motion_); },
       [](const E& e) { return e.motion_; }},
      {"speed_rpm", [](E& e, Text v) { return OrderSpeed(e.shaft_, v, e.now_, e.motion_); },
       [](const E& e) { return NumberText(e.shaft_.At(e.now_).speed_rpm); }},
      {"fault", SetFault, [](const E& e) { return FaultText(e.fault_); }},
      {"power", SetPower, [](const E& e) { return std::string(kPower.at(e.powered_ ? 1 : 0)); }},
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
