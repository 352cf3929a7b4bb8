#include "drivers/saa_can/simulator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace axlecast::saa_can {
namespace {

using Kind = SimulatedFault::Kind;

constexpr MonoNs kBoot = 50 * kMillisecond;
// Frames that a sleeping host receives late; older ones are lost.
constexpr int kMaxLate = 64;
// Limits replies of nodes to each other: the host must continue although they reply without end.
constexpr int kMaxRounds = 16;
constexpr std::array<std::string_view, 2> kOffOn = {"off", "on"};

bool AllZero(Bytes bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte == 0; });
}

}  // namespace

SaaNode::SaaNode(const Setup& setup)
    : TableDevice(setup.seed),
      setup_(setup),
      shaft_(setup.angle),
      node_(setup.node),
      bitrate_(setup.bitrate),
      cyclic_(setup.cyclic),
      period_ms_(setup.period_ms) {}

// "Open electricity, the software will automatically receive a data."
void SaaNode::PowerUp() {
  node_ = std::exchange(next_node_, std::nullopt).value_or(node_);
  bitrate_ = std::exchange(next_bitrate_, std::nullopt).value_or(bitrate_);
  running_ = false;
  configuration_ = false;
  next_position_ = kNever;
  pending_.clear();
  QueuePosition(now_ + kBoot);
}

// ---- frames to the node ----

// "(3) … all data is hexadecimal, … DLC are 8": 2NN, code, NN, and 0 after the printed bytes. The replies of other nodes
// in the dialogue on 7E5 arrive here too.
void SaaNode::OnFrame(const CanFrame& frame, MonoNs now) {
  CatchUp(now);
  if (!powered_) return;
  if (fault_.kind == Kind::kRequestFlip && random_.Share() < fault_.amount * 8) return;
  const Bytes data = frame.data;
  const bool printed = data.size() == 8 && AllZero(data.subspan(3));
  if (frame.id == 0x200U + node_) {
    const bool done = printed && data[1] == node_ && Execute(data, now);
    ++(done ? counters_.requests : counters_.ignored);
  } else if (frame.id == 0x7E5U && !(printed && ExecuteService(data, now))) {
    ++counters_.ignored;
  }
}

// Returns false if the data are none of ① and ④ to ⑧.
bool SaaNode::Execute(Bytes data, MonoNs now) {
  const std::uint8_t code = data[0];
  const std::uint8_t d2 = data[2];
  if ((code == 0x01 || code == 0x80 || code == 0x20) && d2 != 0) return false;
  switch (code) {
    case 0x01:
      running_ = true;
      if (cyclic_ && next_position_ == kNever) next_position_ = now + Period();
      QueuePosition(now + ReplyTime());
      return true;
    case 0x80:
      QueuePosition(now + ReplyTime());
      return true;
    case 0x20:
      zero_ = shaft_.At(now).angle - AngleFromDegrees(zero_error_deg_);
      ++counters_.zeroings;
      break;
    case 0x22:
      if (d2 == setup_.positive) negative_ = false;
      if (d2 == setup_.negative) negative_ = true;
      break;
    case 0x31:
      if (!SetRate(d2, now)) return false;
      break;
    default:
      return false;
  }
  Reply(0x100U + node_, code, 0, now);
  return true;
}

bool SaaNode::SetRate(std::uint8_t per_second, MonoNs now) {
  if (per_second == setup_.stop) {
    cyclic_ = false;
    next_position_ = kNever;
    return true;
  }
  if (per_second == 0) return false;
  cyclic_ = true;
  period_ms_ = 1000.0 / per_second;
  if (running_) next_position_ = now + Period();
  return true;
}

// ②③, and the two states of CiA 305. Returns false if the data are none of them.
bool SaaNode::ExecuteService(Bytes data, MonoNs now) {
  const std::uint32_t reply_id = replies_on_7e4_ ? 0x7E4U : 0x7E5U;
  if (data[0] == 0x04 && data[1] <= 1 && data[2] == 0) {
    configuration_ = data[1] == 1;
    return true;
  }
  if (!configuration_) return false;
  if (data[0] == 0x11 && data[1] != 0 && data[2] == 0) {
    next_node_ = data[1];
    ++counters_.changes;
    Reply(reply_id, 0x11, 0, now);
    if (!changes_at_power_on_) node_ = *std::exchange(next_node_, std::nullopt);
    return true;
  }
  if (data[0] != 0x13 || data[1] != 0) return false;
  const bool known = data[2] == 0x00 || data[2] == 0x02 || data[2] == 0x03;
  if (known) next_bitrate_ = data[2] == 0x00 ? 1'000'000 : data[2] == 0x02 ? 500'000 : 250'000;
  if (known) ++counters_.changes;
  Reply(reply_id, 0x13, known ? 0 : 1, now);
  return true;
}

// ---- frames of the node ----

void SaaNode::Reply(std::uint32_t id, std::uint8_t code, std::uint8_t result, MonoNs now) {
  Queue(now + ReplyTime(), {.id = id, .data = {code, result, 0, 0, 0, 0, 0, 0}});
}

// A position is sampled when it is sent: until then its frame is empty.
void SaaNode::QueuePosition(MonoNs due) { Queue(due, {}); }

MonoNs SaaNode::NextDue() const { return std::min(PendingDue(), powered_ ? next_position_ : kNever); }

void SaaNode::OnDue(MonoNs now, const Send& send) {
  CatchUp(now);
  if (!powered_) return;
  if (next_position_ <= now) {
    const MonoNs late = (now - next_position_) / Period();
    if (late > kMaxLate) next_position_ += (late - kMaxLate) * Period();
  }
  while (next_position_ <= now) {
    const double delay_ms = fault_.kind == Kind::kDelayed ? fault_.amount : 0;
    QueuePosition(next_position_ + std::llround(delay_ms * 1e6));
    next_position_ += Period();
  }
  while (const auto next = TakeDue(now)) Transmit(*next, send);
  // It replies at the old rate, then changes.
  if (pending_.empty() && !changes_at_power_on_) {
    bitrate_ = std::exchange(next_bitrate_, std::nullopt).value_or(bitrate_);
  }
}

void SaaNode::Transmit(const Pending& pending, const Send& send) {
  if (fault_.kind == Kind::kOff || LosesFrame()) {
    ++counters_.unanswered;
    return;
  }
  const bool position = pending.frame.data.empty();
  ++(position ? counters_.positions : counters_.replies);
  send(Damaged(position ? PositionFrame(pending.due - std::llround(processing_us_ * 1e3)) : pending.frame));
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

// ---- quantities ----

Result<> SaaNode::SetFault(std::string_view text) {
  const Result<SimulatedFault> fault = ParseFault(text);
  if (!fault) return Failure(fault.error());
  if (fault->kind == Kind::kEcho) return Failure("echo: no CAN controller receives its own frames");
  if (fault->kind == Kind::kScattered) return Failure(kNotOnCan);
  fault_ = *fault;
  stuck_at_ = shaft_.At(now_).angle;
  return {};
}

Result<> SaaNode::SetCyclic(std::string_view text) {
  const Result<std::size_t> on = ParseChoice(text, kOffOn);
  if (!on) return Failure(on.error());
  cyclic_ = *on == 1;
  next_position_ = cyclic_ && running_ ? now_ + Period() : kNever;
  return {};
}

Result<> SaaNode::SetPower(std::string_view text) {
  const Result<std::size_t> on = ParseChoice(text, kOffOn);
  if (!on) return Failure(on.error());
  const bool was = std::exchange(powered_, *on == 1);
  if (!powered_) pending_.clear();
  if (powered_ && !was && started_) PowerUp();
  return {};
}

const QuantityTable<SaaNode>& SaaNode::Table() {
  using N = SaaNode;
  static const QuantityTable<N> kTable = {
      WholeQuantity<N>("node", &N::node_, 1, 255, "(NN)"),
      WholeQuantity<N>("bitrate", &N::bitrate_, 10'000, 1'000'000, "bit/s"),
      NumberQuantity<N>("period_ms", &N::period_ms_, 1, 1'000, "ms"),
      NumberQuantity<N>("period_factor", &N::stretch_, 0.1, 10, ""),
      {"cyclic", [](N& n, std::string_view text) { return n.SetCyclic(text); },
       [](const N& n) { return std::string(kOffOn.at(n.cyclic_ ? 1 : 0)); }},
      ChoiceQuantity<N>("counting", &N::negative_, {"positive", "negative"}),
      WholeQuantity<N>("length", &N::length_, 0, 8, "bytes"),
      ChoiceQuantity<N>("replies_on", &N::replies_on_7e4_, {"7e5", "7e4"}),
      ChoiceQuantity<N>("changes", &N::changes_at_power_on_, {"at_once", "at_power_on"}),
      NumberQuantity<N>("reply_us", &N::reply_us_, 0, 1e6, "us"),
      NumberQuantity<N>("processing_us", &N::processing_us_, 0, 1e6, "us"),
      WholeQuantity<N>("noise_counts", &N::noise_counts_, 0, 1'000, "counts"),
      NumberQuantity<N>("zero_error_deg", &N::zero_error_deg_, -10, 10, "deg"),
      AccelerationQuantity<N>(&N::shaft_),
      MotionQuantity<N>(&N::shaft_, &N::now_),
      SpeedQuantity<N>(&N::shaft_, &N::now_),
      {"fault", [](N& n, std::string_view text) { return n.SetFault(text); },
       [](const N& n) { return FaultText(n.fault_); }},
      {"power", [](N& n, std::string_view text) { return n.SetPower(text); },
       [](const N& n) { return std::string(kOffOn.at(n.powered_ ? 1 : 0)); }},
  };
  return kTable;
}

QuantityList SaaNode::State(MonoNs now) const {
  SaaNode node = *this;
  node.Advance(now);
  QuantityList list = node.ShownQuantities();
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(node.shaft_.At(now).angle)));
  list.emplace_back("single_turn", std::to_string(node.CountsAt(now)));
  list.emplace_back("mode", configuration_ ? "configuration" : "waiting");
  list.emplace_back("started", running_ ? "yes" : "no");
  AddCounters(list, {{"positions", counters_.positions},
                     {"requests", counters_.requests},
                     {"replies", counters_.replies},
                     {"ignored", counters_.ignored},
                     {"unanswered", counters_.unanswered},
                     {"zeroings", counters_.zeroings},
                     {"changes", counters_.changes}});
  return list;
}

// ---- the bus ----

CanBus::CanBus(std::int64_t bitrate, std::vector<Unit> units, std::uint64_t seed)
    : configured_(bitrate), units_(std::move(units)), to_host_(units_.size()), random_(seed), host_(bitrate) {}

std::int64_t CanBus::RateOf(const SimulatedCanNode& node) const {
  return node.bitrate() == 0 ? configured_ : node.bitrate();
}

bool CanBus::Broadcast(const SimulatedCanNode* from, std::int64_t rate, const CanFrame& frame, MonoNs now) {
  bool acknowledged = false;
  for (Unit& unit : units_) {
    if (unit.node.get() == from || !unit.node->present() || RateOf(*unit.node) != rate) continue;
    acknowledged = true;
    unit.node->OnFrame(frame, now);
  }
  return acknowledged;
}

bool CanBus::OnFrame(const CanFrame& frame, MonoNs now, const Transmit& transmit) {
  OnDue(now, transmit);
  const bool acknowledged = Broadcast(nullptr, host_, frame, now);
  ++(acknowledged ? host_frames_ : unacknowledged_);
  return acknowledged;
}

MonoNs CanBus::NextDue() const {
  MonoNs due = kNever;
  for (const Unit& unit : units_) due = std::min(due, unit.node->NextDue());
  for (const ToHost& way : to_host_) due = std::min(due, way.held.empty() ? kNever : way.held.front().due);
  return due;
}

void CanBus::OnDue(MonoNs now, const Transmit& transmit) {
  for (int round = 0; round < kMaxRounds && NextDue() <= now; ++round) {
    for (std::size_t unit = 0; unit < units_.size(); ++unit) Serve(unit, now, transmit);
  }
}

void CanBus::Serve(std::size_t unit, MonoNs now, const Transmit& transmit) {
  SimulatedCanNode& node = *units_[unit].node;
  ToHost& way = to_host_[unit];
  node.OnDue(now, [&](const CanFrame& frame) {
    const std::int64_t rate = RateOf(node);
    const bool taken = Broadcast(&node, rate, frame, now);
    if (rate == host_) {
      const bool late = node.fault().kind == Kind::kLate;
      way.held.push_back({way.adapter.Due(now, late ? node.fault() : SimulatedFault{}, random_), ToPacket(frame)});
    } else if (!taken) {
      ++unheard_;
    }
  });
  for (; !way.held.empty() && way.held.front().due <= now; way.held.pop_front()) transmit(way.held.front().packet);
}

Result<> CanBus::Set(std::string_view device, std::string_view key, std::string_view value, MonoNs now) {
  const Unit* unit = FindUnit(units_, device);
  if (unit == nullptr) return Failure("no simulated device '" + std::string(device) + "' here");
  unit->node->Advance(now);
  const Result<> done = unit->node->Set(key, value);
  if (!done) return Failure(unit->name + '.' + std::string(key) + ": " + done.error().text);
  return {};
}

QuantityList CanBus::State(std::string_view device, MonoNs now) const {
  const Unit* unit = FindUnit(units_, device);
  if (unit == nullptr) return {};
  QuantityList list = unit->node->State(now);
  list.emplace_back("host_frames", std::to_string(host_frames_));
  list.emplace_back("unacknowledged", std::to_string(unacknowledged_));
  list.emplace_back("unheard", std::to_string(unheard_));
  return list;
}

}  // namespace axlecast::saa_can
