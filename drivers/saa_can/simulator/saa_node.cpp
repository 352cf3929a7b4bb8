#include "drivers/saa_can/simulator/saa_node.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft.h"

namespace axlecast::saa_can {
namespace {

using Kind = SimulatedFault::Kind;

constexpr MonoNs kBoot = 50 * kMillisecond;
// Frames that a sleeping host is served late; older ones nobody hears any more.
constexpr int kMaxLate = 64;

bool AllZero(Bytes bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte == 0; });
}

}  // namespace

SaaNode::SaaNode(const Setup& setup)
    : setup_(setup),
      shaft_(setup.angle),
      random_(setup.seed),
      node_(setup.node),
      bitrate_(setup.bitrate),
      next_node_(setup.node),
      next_bitrate_(setup.bitrate),
      cyclic_(setup.cyclic),
      period_ms_(setup.period_ms) {}

void SaaNode::CatchUp(MonoNs now) {
  if (!begun_) {
    begun_ = true;
    now_ = now;
    script_.Start(*this, now);
    if (powered_) PowerOn(now);
  }
  script_.Run(*this, now);
  now_ = now;
}

// "Open electricity, the software will automatically receive a data."
void SaaNode::PowerOn(MonoNs at) {
  node_ = next_node_;
  bitrate_ = next_bitrate_;
  running_ = false;
  configuration_ = false;
  next_position_ = kNever;
  pending_.clear();
  Queue(at + kBoot, {}, true);
}

// ---- what it is told ----

void SaaNode::OnFrame(const CanFrame& frame, MonoNs now) {
  CatchUp(now);
  if (!powered_) return;
  const bool lost = fault_.kind == Kind::kRequestFlip && random_.Share() < fault_.amount * 8;
  if (lost) return;
  if (frame.id == 0x200U + node_) OnCommand(frame, now);
  if (frame.id == 0x7E5U) OnService(frame, now);
}

// "(3) … all data is hexadecimal, … DLC are 8": 2NN, code, NN, and 0 behind what is printed.
void SaaNode::OnCommand(const CanFrame& frame, MonoNs now) {
  const Bytes data = frame.data;
  const bool printed = data.size() == 8 && data[1] == node_ && AllZero(data.subspan(3));
  if (!printed || !Execute(frame, now)) {
    ++counters_.ignored;
    return;
  }
  ++counters_.requests;
}

// False when it is none of ① and ④ to ⑧.
bool SaaNode::Execute(const CanFrame& frame, MonoNs now) {
  const Bytes data = frame.data;
  const std::uint8_t d2 = data[2];
  switch (data[0]) {
    case 0x01:
      if (d2 != 0) return false;
      running_ = true;
      if (cyclic_ && next_position_ == kNever) next_position_ = now + Period();
      AnswerPosition(now);
      return true;
    case 0x80:
      if (d2 != 0) return false;
      AnswerPosition(now);
      return true;
    case 0x20:
      if (d2 != 0) return false;
      zero_ = shaft_.At(now).angle - AngleFromDegrees(zero_error_deg_);
      ++counters_.zeroings;
      Answer(0x20, now);
      return true;
    case 0x22:
      if (d2 == setup_.positive) negative_ = false;
      if (d2 == setup_.negative) negative_ = true;
      Answer(0x22, now);
      return true;
    case 0x31:
      return TakePeriod(d2, now);
    default:
      return false;
  }
}

bool SaaNode::TakePeriod(std::uint8_t per_second, MonoNs now) {
  if (per_second == setup_.stop) {
    cyclic_ = false;
    next_position_ = kNever;
  } else if (per_second == 0) {
    return false;
  } else {
    cyclic_ = true;
    period_ms_ = 1000.0 / per_second;
    if (running_) next_position_ = now + Period();
  }
  Answer(0x31, now);
  return true;
}

// ②③, and the two states of CiA 305. Other nodes' replies are heard here too.
void SaaNode::OnService(const CanFrame& frame, MonoNs now) {
  const Bytes data = frame.data;
  const bool whole = data.size() == 8 && AllZero(data.subspan(3));
  if (whole && data[0] == 0x04 && data[1] <= 1 && data[2] == 0) {
    configuration_ = data[1] == 1;
  } else if (!whole || !configuration_ || !Configure(data, now)) {
    ++counters_.ignored;
  }
}

// False when it is none of ②③.
bool SaaNode::Configure(Bytes data, MonoNs now) {
  if (data[0] == 0x11 && data[1] != 0 && data[2] == 0) {
    next_node_ = data[1];
    ++counters_.changes;
    AnswerService(0x11, 0, now);
    if (!changes_at_power_on_) node_ = next_node_;
    return true;
  }
  if (data[0] != 0x13 || data[1] != 0) return false;
  const bool known = data[2] == 0x00 || data[2] == 0x02 || data[2] == 0x03;
  if (known) next_bitrate_ = data[2] == 0x00 ? 1'000'000 : data[2] == 0x02 ? 500'000 : 250'000;
  if (known) ++counters_.changes;
  AnswerService(0x13, known ? 0 : 1, now);
  return true;
}

// ---- what it says ----

void SaaNode::Answer(std::uint8_t code, MonoNs now) {
  Queue(now + ReplyTime(), {.id = 0x100U + node_, .data = {code, 0, 0, 0, 0, 0, 0, 0}}, false);
}

void SaaNode::AnswerService(std::uint8_t code, std::uint8_t result, MonoNs now) {
  const std::uint32_t id = replies_on_7e4_ ? 0x7E4U : 0x7E5U;
  Queue(now + ReplyTime(), {.id = id, .data = {code, result, 0, 0, 0, 0, 0, 0}}, false);
}

void SaaNode::AnswerPosition(MonoNs now) { Queue(now + ReplyTime(), {}, true); }

void SaaNode::Queue(MonoNs due, const CanFrame& frame, bool position) {
  const auto place = std::upper_bound(pending_.begin(), pending_.end(), due,
                                      [](MonoNs at, const Pending& pending) { return at < pending.due; });
  pending_.insert(place, {due, frame, position});
}

MonoNs SaaNode::NextDue() const {
  if (!begun_) return 0;
  MonoNs due = std::min(script_.NextDue(), powered_ ? next_position_ : kNever);
  if (!pending_.empty()) due = std::min(due, pending_.front().due);
  return due;
}

void SaaNode::OnDue(MonoNs now, const Send& send) {
  CatchUp(now);
  if (!powered_) return;
  if (next_position_ <= now) {
    const MonoNs late = (now - next_position_) / Period();
    if (late > kMaxLate) next_position_ += (late - kMaxLate) * Period();
  }
  while (next_position_ <= now) {
    const double delay_ms = fault_.kind == Kind::kDelayed ? fault_.amount : 0;
    Queue(next_position_ + std::llround(delay_ms * 1e6), {}, true);
    next_position_ += Period();
  }
  while (!pending_.empty() && pending_.front().due <= now) {
    const Pending next = pending_.front();
    pending_.erase(pending_.begin());
    Say(next, send);
  }
  // It answers at the old rate, and then changes.
  if (pending_.empty() && !changes_at_power_on_) bitrate_ = next_bitrate_;
}

void SaaNode::Say(const Pending& pending, const Send& send) {
  const bool silent =
      fault_.kind == Kind::kOff || (fault_.kind == Kind::kIntermittent && random_.Share() < fault_.amount);
  if (silent) {
    ++counters_.unanswered;
    return;
  }
  CanFrame frame = pending.frame;
  if (pending.position) frame = PositionFrame(pending.due - std::llround(processing_us_ * 1e3));
  ++(pending.position ? counters_.positions : counters_.replies);
  std::vector<std::uint8_t> data(Bytes(frame.data).begin(), Bytes(frame.data).end());
  data.resize(Damage(std::span(data), fault_, random_));
  frame.data = InlineBytes<kMaxCanData>(Bytes(data));
  send(frame);
}

// "47 26" is 2647H: the bottom eight bits first.
CanFrame SaaNode::PositionFrame(MonoNs sampled) {
  const auto noise = static_cast<std::int64_t>(noise_counts_);
  const auto shift = static_cast<std::uint32_t>(noise == 0 ? 0 : random_.Around(noise));
  const std::uint32_t counts = (CountsAt(sampled) + shift) & ((1U << static_cast<unsigned>(setup_.bits)) - 1);
  const unsigned bytes = setup_.bits <= 16 ? 2 : setup_.bits <= 24 ? 3 : 4;
  CanFrame frame{.id = 0x100U + node_, .data = {}};
  for (unsigned i = 0; i < 8 && i < static_cast<unsigned>(length_); ++i) {
    const unsigned place = setup_.big_endian ? bytes - 1 - i : i;
    frame.data.Append(static_cast<std::uint8_t>(i < bytes ? counts >> 8 * place : 0));
  }
  return frame;
}

std::uint32_t SaaNode::CountsAt(MonoNs at) const {
  const ShaftAngle angle = fault_.kind == Kind::kStuck ? stuck_at_ : shaft_.At(at).angle;
  const ShaftAngle turned = (negative_ ? zero_ - angle : angle - zero_) & (kShaftTurn - 1);
  return static_cast<std::uint32_t>(turned >> static_cast<unsigned>(kTurnBits - setup_.bits));
}

MonoNs SaaNode::Period() const {
  return std::max<MonoNs>(100 * kMicrosecond, std::llround(period_ms_ * stretch_ * 1e6));
}

MonoNs SaaNode::ReplyTime() const {
  double time_us = reply_us_;
  if (fault_.kind == Kind::kSlow) time_us += fault_.amount;
  if (fault_.kind == Kind::kDelayed) time_us += fault_.amount * 1e3;
  return std::llround(time_us * 1e3);
}

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
