#include <cmath>
#include <string>

#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/saa_can/simulator/saa_node.h"

namespace axlecast::saa_can {

// What can be set of an encoder, and what is shown of it.
struct SaaNodeQuantities {
  using N = SaaNode;
  using Text = std::string_view;

  static const QuantityTable<N>& Table();

  static std::string Choose(Text value, Text no, Text yes, bool& into) {
    if (value != no && value != yes) {
      return "'" + std::string(value) + "' is neither " + std::string(no) + " nor " + std::string(yes);
    }
    into = value == yes;
    return {};
  }
  static std::string Word(bool is, Text no, Text yes) { return std::string(is ? yes : no); }

  static std::string SetWhole(Text value, double minimum, double maximum, Text unit, double& into) {
    double number = 0;
    std::string problem = ReadNumber(value, minimum, maximum, unit, number);
    if (problem.empty()) into = std::floor(number);
    return problem;
  }
  static std::string SetNode(N& n, Text value) {
    double number = 0;
    std::string problem = SetWhole(value, 1, 255, "(NN)", number);
    if (problem.empty()) n.node_ = n.next_node_ = static_cast<std::uint8_t>(number);
    return problem;
  }
  static std::string SetBitrate(N& n, Text value) {
    double number = 0;
    std::string problem = SetWhole(value, 10'000, 1'000'000, "bit/s", number);
    if (problem.empty()) n.bitrate_ = n.next_bitrate_ = static_cast<std::int64_t>(number);
    return problem;
  }
  static std::string SetCyclic(N& n, Text value) {
    std::string problem = Choose(value, "off", "on", n.cyclic_);
    if (problem.empty()) n.next_position_ = n.cyclic_ && n.running_ ? n.now_ + n.Period() : kNever;
    return problem;
  }
  static std::string SetFault(N& n, Text value) {
    SimulatedFault fault;
    std::string problem = ParseFault(value, fault);
    if (problem.empty() && fault.kind == SimulatedFault::Kind::kEcho)
      problem = "echo: no CAN controller hears itself";
    if (problem.empty() && fault.kind == SimulatedFault::Kind::kScattered) problem = kNotOnCan;
    if (!problem.empty()) return problem;
    n.fault_ = fault;
    n.stuck_at_ = n.shaft_.At(n.now_).angle;
    return {};
  }
  static std::string SetPower(N& n, Text value) {
    const bool was = n.powered_;
    std::string problem = Choose(value, "off", "on", n.powered_);
    if (!n.powered_) n.pending_.clear();
    if (problem.empty() && n.powered_ && !was && n.begun_) n.PowerOn(n.now_);
    return problem;
  }
};

const QuantityTable<SaaNode>& SaaNodeQuantities::Table() {
  static const QuantityTable<N> kTable = {
      {"node", SetNode, [](const N& n) { return std::to_string(n.node_); }},
      {"bitrate", SetBitrate, [](const N& n) { return std::to_string(n.bitrate_); }},
      {"period_ms", [](N& n, Text v) { return ReadNumber(v, 1, 1'000, "ms", n.period_ms_); },
       [](const N& n) { return NumberText(n.period_ms_); }},
      {"period_factor", [](N& n, Text v) { return ReadNumber(v, 0.1, 10, "", n.stretch_); },
       [](const N& n) { return NumberText(n.stretch_); }},
      {"cyclic", SetCyclic, [](const N& n) { return Word(n.cyclic_, "off", "on"); }},
      {"counting", [](N& n, Text v) { return Choose(v, "positive", "negative", n.negative_); },
       [](const N& n) { return Word(n.negative_, "positive", "negative"); }},
      {"length", [](N& n, Text v) { return SetWhole(v, 0, 8, "bytes", n.length_); },
       [](const N& n) { return NumberText(n.length_); }},
      {"replies_on", [](N& n, Text v) { return Choose(v, "7e5", "7e4", n.replies_on_7e4_); },
       [](const N& n) { return Word(n.replies_on_7e4_, "7e5", "7e4"); }},
      {"changes", [](N& n, Text v) { return Choose(v, "at_once", "at_power_on", n.changes_at_power_on_); },
       [](const N& n) { return Word(n.changes_at_power_on_, "at_once", "at_power_on"); }},
      {"reply_us", [](N& n, Text v) { return ReadNumber(v, 0, 1e6, "us", n.reply_us_); },
       [](const N& n) { return NumberText(n.reply_us_); }},
      {"processing_us", [](N& n, Text v) { return ReadNumber(v, 0, 1e6, "us", n.processing_us_); },
       [](const N& n) { return NumberText(n.processing_us_); }},
      {"noise_counts", [](N& n, Text v) { return SetWhole(v, 0, 1'000, "counts", n.noise_counts_); },
       [](const N& n) { return NumberText(n.noise_counts_); }},
      {"zero_error_deg", [](N& n, Text v) { return ReadNumber(v, -10, 10, "deg", n.zero_error_deg_); },
       [](const N& n) { return NumberText(n.zero_error_deg_); }},
      {"accel_rad_s2", [](N& n, Text v) { return OrderAcceleration(n.shaft_, v); },
       [](const N& n) { return NumberText(n.shaft_.acceleration_rad_s2()); }},
      {"motion", [](N& n, Text v) { return OrderMotion(n.shaft_, v, n.now_, n.motion_); },
       [](const N& n) { return n.motion_; }},
      {"speed_rpm", [](N& n, Text v) { return OrderSpeed(n.shaft_, v, n.now_, n.motion_); },
       [](const N& n) { return NumberText(n.shaft_.At(n.now_).speed_rpm); }},
      {"fault", SetFault, [](const N& n) { return FaultText(n.fault_); }},
      {"power", SetPower, [](const N& n) { return Word(n.powered_, "off", "on"); }},
  };
  return kTable;
}

const std::vector<std::string_view>& SaaNode::QuantityNames() {
  static const std::vector<std::string_view> kNames = NamesOf(SaaNodeQuantities::Table());
  return kNames;
}

Result<> SaaNode::Set(std::string_view name, std::string_view value) {
  return SetByName(SaaNodeQuantities::Table(), *this, name, value);
}

std::vector<std::pair<std::string, std::string>> SaaNode::State(MonoNs now) const {
  SaaNode node = *this;
  node.Advance(now);
  std::vector<std::pair<std::string, std::string>> list = Shown(SaaNodeQuantities::Table(), node);
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(node.shaft_.At(now).angle)));
  count("single_turn", node.CountsAt(now));
  list.emplace_back("mode", configuration_ ? "configuration" : "waiting");
  list.emplace_back("started", running_ ? "yes" : "no");
  count("positions", counters_.positions);
  count("requests", counters_.requests);
  count("replies", counters_.replies);
  count("ignored", counters_.ignored);
  count("unanswered", counters_.unanswered);
  count("zeroings", counters_.zeroings);
  count("changes", counters_.changes);
  return list;
}

}  // namespace axlecast::saa_can
