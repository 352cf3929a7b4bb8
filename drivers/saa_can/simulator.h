#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/device/simulator.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_can_node.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast::saa_can {

// An SAA encoder on CAN as the maker's manual describes it (5.4.1), written from the manual and not from the driver:
// cyclic and requested positions, zero, direction, rate, and the dialogue on 7E5 that every node obeys. It drops unknown
// frames and counts them. Where the manual states nothing, it does what is harder for a driver:
//
// - When it is switched on, it sends one position ("the software will automatically receive a data") and no other until
//   it is started.
// - It accepts only commands of 8 bytes, with its own NN in D1 and 0 after the printed bytes.
// - Its period is 6.4 % longer than the one that was set, as in the manual's log.
// - It stays in configuration mode until 04 00 comes (CiA 305) or its power goes.
class SaaNode final : public TableDevice<SaaNode, SimulatedCanNode> {
 public:
  struct Setup {
    std::uint8_t node = 0x20;
    int bits = 14;
    bool big_endian = false;
    std::int64_t bitrate = 250'000;
    double period_ms = 100;
    bool cyclic = true;
    // The bytes that the manual leaves out; -1: the command is accepted and does nothing.
    int positive = -1;
    int negative = -1;
    int stop = -1;
    ShaftAngle angle = 0;
    std::uint64_t seed = 1;
  };
  explicit SaaNode(const Setup& setup)
      : TableDevice(setup.seed),
        setup_(setup),
        shaft_(setup.angle),
        node_(setup.node),
        bitrate_(setup.bitrate),
        cyclic_(setup.cyclic),
        period_ms_(setup.period_ms) {}

  [[nodiscard]] bool present() const override { return powered_; }
  [[nodiscard]] std::int64_t bitrate() const override { return bitrate_; }
  // "(3) … all data is hexadecimal, … DLC are 8": 2NN, code, NN, and 0 after the printed bytes. The replies of other nodes
  // in the dialogue on 7E5 arrive here too.
  void OnFrame(const CanFrame& frame, MonoNs now) override {
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
  [[nodiscard]] MonoNs NextDue() const override {
    return std::min(PendingDue(), powered_ ? next_position_ : kNever);
  }
  void OnDue(MonoNs now, const Send& send) override {
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
  [[nodiscard]] QuantityList State(MonoNs now) const override {
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
  [[nodiscard]] static const QuantityTable<SaaNode>& Table() {
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

  // Counted since the start.
  struct Counters {
    std::int64_t positions = 0;  // sent
    std::int64_t requests = 0;   // accepted commands
    std::int64_t replies = 0;    // to commands and in the dialogue
    std::int64_t ignored =
        0;  // commands of another length, node or form than printed; services while not configuring
    std::int64_t unanswered = 0;  // because of a fault
    std::int64_t zeroings = 0;
    std::int64_t changes = 0;  // of node id and bit rate
  };

 private:
  using Kind = SimulatedFault::Kind;

  static constexpr MonoNs kBoot = 50 * kMillisecond;
  // Frames that a sleeping host receives late; older ones are lost.
  static constexpr int kMaxLate = 64;
  static constexpr std::array<std::string_view, 2> kOffOn = {"off", "on"};

  [[nodiscard]] static bool AllZero(Bytes bytes) {
    return std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte == 0; });
  }
  // "Open electricity, the software will automatically receive a data."
  void PowerUp() override {
    node_ = std::exchange(next_node_, std::nullopt).value_or(node_);
    bitrate_ = std::exchange(next_bitrate_, std::nullopt).value_or(bitrate_);
    running_ = false;
    configuration_ = false;
    next_position_ = kNever;
    pending_.clear();
    QueuePosition(now_ + kBoot);
  }
  // Returns false if the data are none of ① and ④ to ⑧.
  [[nodiscard]] bool Execute(Bytes data, MonoNs now) {
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
  [[nodiscard]] bool SetRate(std::uint8_t per_second, MonoNs now) {
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
  [[nodiscard]] bool ExecuteService(Bytes data, MonoNs now) {
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
  [[nodiscard]] Result<> SetCyclic(std::string_view text) {
    const Result<std::size_t> on = ParseChoice(text, kOffOn);
    if (!on) return Failure(on.error());
    cyclic_ = *on == 1;
    next_position_ = cyclic_ && running_ ? now_ + Period() : kNever;
    return {};
  }
  [[nodiscard]] Result<> SetFault(std::string_view text) {
    const Result<SimulatedFault> fault = ParseFault(text);
    if (!fault) return Failure(fault.error());
    if (fault->kind == Kind::kEcho) return Failure("echo: no CAN controller receives its own frames");
    if (fault->kind == Kind::kScattered) return Failure(kNotOnCan);
    fault_ = *fault;
    stuck_at_ = shaft_.At(now_).angle;
    return {};
  }
  [[nodiscard]] Result<> SetPower(std::string_view text) {
    const Result<std::size_t> on = ParseChoice(text, kOffOn);
    if (!on) return Failure(on.error());
    const bool was = std::exchange(powered_, *on == 1);
    if (!powered_) pending_.clear();
    if (powered_ && !was && started_) PowerUp();
    return {};
  }
  void Reply(std::uint32_t id, std::uint8_t code, std::uint8_t result, MonoNs now) {
    Queue(now + ReplyTime(), {.id = id, .data = {code, result, 0, 0, 0, 0, 0, 0}});
  }
  // A position is sampled when it is sent: until then its frame is empty.
  void QueuePosition(MonoNs due) { Queue(due, {}); }
  void Transmit(const Pending& pending, const Send& send) {
    if (fault_.kind == Kind::kOff || LosesFrame()) {
      ++counters_.unanswered;
      return;
    }
    const bool position = pending.frame.data.empty();
    ++(position ? counters_.positions : counters_.replies);
    send(Damaged(position ? PositionFrame(pending.due - std::llround(processing_us_ * 1e3)) : pending.frame));
  }
  // "47 26" is 2647H: the bottom eight bits first.
  [[nodiscard]] CanFrame PositionFrame(MonoNs sampled) {
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
  [[nodiscard]] std::uint32_t CountsAt(MonoNs at) const {
    const ShaftAngle angle = fault_.kind == Kind::kStuck ? stuck_at_ : shaft_.At(at).angle;
    const ShaftAngle turned = (negative_ ? zero_ - angle : angle - zero_) & (kShaftTurn - 1);
    return static_cast<std::uint32_t>(turned >> static_cast<unsigned>(kTurnBits - setup_.bits));
  }
  [[nodiscard]] MonoNs Period() const {
    return std::max<MonoNs>(100 * kMicrosecond, std::llround(period_ms_ * stretch_ * 1e6));
  }
  [[nodiscard]] MonoNs ReplyTime() const {
    double time_us = reply_us_;
    if (fault_.kind == Kind::kSlow) time_us += fault_.amount;
    if (fault_.kind == Kind::kDelayed) time_us += fault_.amount * 1e3;
    return std::llround(time_us * 1e3);
  }

  const Setup setup_;
  Shaft shaft_;
  bool powered_ = true;
  bool running_ = false;        // started since it was switched on
  bool configuration_ = false;  // mode of the dialogue
  std::uint8_t node_;
  std::int64_t bitrate_;
  std::optional<std::uint8_t> next_node_;  // taken at once, or when it is switched on
  std::optional<std::int64_t> next_bitrate_;
  bool cyclic_;
  double period_ms_;
  double stretch_ = 1.064;
  bool negative_ = false;
  ShaftAngle zero_ = 0;
  ShaftAngle stuck_at_ = 0;

  double reply_us_ = 300;
  double processing_us_ = 200;
  double noise_counts_ = 0;
  double zero_error_deg_ = 0;
  double length_ = 8;            // of position frames
  bool replies_on_7e4_ = false;  // in the dialogue
  bool changes_at_power_on_ = false;

  MonoNs next_position_ = kNever;
  Counters counters_;
};

// The nodes on one simulated CAN bus, and the bus between them and the host. Each frame reaches all other nodes that run
// at the same bit rate. It is acknowledged if there is one.
class CanBus final : public Simulator {
 public:
  struct Unit {
    std::string name;
    std::unique_ptr<SimulatedCanNode> node;
  };
  // `bitrate`: of the bus as configured. `seed`: of the delays of the host's adapter.
  CanBus(std::int64_t bitrate, std::vector<Unit> units, std::uint64_t seed = 1)
      : configured_(bitrate), units_(std::move(units)), to_host_(units_.size()), random_(seed), host_(bitrate) {}

  [[nodiscard]] bool OnFrame(const CanFrame& frame, MonoNs now, const Transmit& transmit) override {
    OnDue(now, transmit);
    const bool acknowledged = Broadcast(nullptr, host_, frame, now);
    ++(acknowledged ? host_frames_ : unacknowledged_);
    return acknowledged;
  }
  void OnBaud(std::int64_t bitrate) override { host_ = bitrate; }
  [[nodiscard]] MonoNs NextDue() const override {
    MonoNs due = kNever;
    for (const Unit& unit : units_) due = std::min(due, unit.node->NextDue());
    for (const ToHost& way : to_host_) due = std::min(due, way.held.empty() ? kNever : way.held.front().due);
    return due;
  }
  void OnDue(MonoNs now, const Transmit& transmit) override {
    for (int round = 0; round < kMaxRounds && NextDue() <= now; ++round) {
      for (std::size_t unit = 0; unit < units_.size(); ++unit) Serve(unit, now, transmit);
    }
  }
  [[nodiscard]] Result<> Set(std::string_view device, std::string_view key, std::string_view value,
                             MonoNs now) override {
    const Unit* unit = FindUnit(units_, device);
    if (unit == nullptr) return Failure("no simulated device '" + std::string(device) + "' here");
    unit->node->Advance(now);
    const Result<> done = unit->node->Set(key, value);
    if (!done) return Failure(unit->name + '.' + std::string(key) + ": " + done.error().text);
    return {};
  }
  [[nodiscard]] QuantityList State(std::string_view device, MonoNs now) const override {
    const Unit* unit = FindUnit(units_, device);
    if (unit == nullptr) return {};
    QuantityList list = unit->node->State(now);
    list.emplace_back("host_frames", std::to_string(host_frames_));
    list.emplace_back("unacknowledged", std::to_string(unacknowledged_));
    list.emplace_back("unheard", std::to_string(unheard_));
    return list;
  }

 private:
  // Limits replies of nodes to each other: the host must continue although they reply without end.
  static constexpr int kMaxRounds = 16;

  // Frames of a node that the host's adapter holds back: fault `late`.
  struct Held {
    MonoNs due = 0;
    CanPacket packet = {};
  };
  struct ToHost {
    LateAdapter adapter;
    std::deque<Held> held;
  };

  [[nodiscard]] std::int64_t RateOf(const SimulatedCanNode& node) const {
    return node.bitrate() == 0 ? configured_ : node.bitrate();
  }
  // Passes the frame of `from`, null for the host, to the other nodes. Returns whether one of them received it.
  bool Broadcast(const SimulatedCanNode* from, std::int64_t rate, const CanFrame& frame, MonoNs now) {
    bool acknowledged = false;
    for (Unit& unit : units_) {
      if (unit.node.get() == from || !unit.node->present() || RateOf(*unit.node) != rate) continue;
      acknowledged = true;
      unit.node->OnFrame(frame, now);
    }
    return acknowledged;
  }
  void Serve(std::size_t unit, MonoNs now, const Transmit& transmit) {
    SimulatedCanNode& node = *units_[unit].node;
    ToHost& way = to_host_[unit];
    node.OnDue(now, [&](const CanFrame& frame) {
      const std::int64_t rate = RateOf(node);
      const bool taken = Broadcast(&node, rate, frame, now);
      if (rate == host_) {
        const bool late = node.fault().kind == SimulatedFault::Kind::kLate;
        way.held.push_back(
            {way.adapter.Due(now, late ? node.fault() : SimulatedFault{}, random_), ToPacket(frame)});
      } else if (!taken) {
        ++unheard_;
      }
    });
    for (; !way.held.empty() && way.held.front().due <= now; way.held.pop_front())
      transmit(way.held.front().packet);
  }

  const std::int64_t configured_;
  std::vector<Unit> units_;
  std::vector<ToHost> to_host_;  // of each unit
  SeededRandom random_;
  std::int64_t host_;                // bit rate of the host
  std::int64_t host_frames_ = 0;     // acknowledged
  std::int64_t unacknowledged_ = 0;  // of the host
  std::int64_t unheard_ = 0;         // of a node, with neither host nor node to acknowledge them
};

}  // namespace axlecast::saa_can
