#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_can_node.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast::cia406 {

// The object dictionary of a simulated CANopen device (CiA 301 7.4).
class SimulatedDictionary {
 public:
  using Place = std::pair<std::uint16_t, std::uint8_t>;  // index, sub-index
  struct Object {
    std::uint8_t bytes = 0;  // 1, 2, 4; 0: a text, longer than an expedited transfer holds
    bool writable = false;
    std::uint32_t value = 0;  // of a text its length
  };

  void Add(Place place, const Object& object) { objects_[place] = object; }
  void AddRecord(std::uint16_t index, std::uint8_t highest_sub) {
    Add({index, 0}, {.bytes = 1, .writable = false, .value = highest_sub});
  }  // its sub-index 0

  // Returns the object; null if it does not exist.
  [[nodiscard]] const Object* Find(Place place) const {
    const auto found = objects_.find(place);
    return found == objects_.end() ? nullptr : &found->second;
  }
  // Returns the abort code of table 22 for an object that does not exist.
  [[nodiscard]] std::uint32_t MissingCode(Place place) const {
    const auto first = objects_.lower_bound({place.first, 0});
    return first != objects_.end() && first->first.first == place.first ? kNoSubIndex : kNoObject;
  }
  // Sets the value of an object that exists, also of one that a client may only read.
  void Put(Place place, std::uint32_t value) {
    if (const auto found = objects_.find(place); found != objects_.end()) found->second.value = value;
  }
  // Returns the value; 0 if the object does not exist.
  [[nodiscard]] std::uint32_t Get(Place place) const {
    const Object* object = Find(place);
    return object == nullptr ? 0 : object->value;
  }
  // "1017:00=500" sets an object, "1018:04=none" removes it. The error states what would be right.
  [[nodiscard]] Result<> Change(std::string_view text) {
    const std::size_t colon = text.find(':');
    const std::size_t equals = text.find('=');
    std::uint32_t index = 0;
    std::uint32_t sub = 0;
    std::uint32_t value = 0;
    const bool removed = text.ends_with("=none");
    if (equals == std::string_view::npos || colon > equals || !ReadNumber(text.substr(0, colon), 16, index) ||
        index > 0xFFFF || !ReadNumber(text.substr(colon + 1, equals - colon - 1), 16, sub) || sub > 0xFF ||
        (!removed && !ReadNumber(text.substr(equals + 1), 10, value))) {
      return Failure("an object is changed by INDEX:SUB=VALUE or INDEX:SUB=none, e.g. 1017:00=500");
    }
    const Place place{static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub)};
    if (Find(place) == nullptr) return Failure("there is no object " + std::string(text.substr(0, equals)));
    if (removed) {
      objects_.erase(place);
    } else {
      Put(place, value);
    }
    return {};
  }

 private:
  // Abort codes of CiA 301 table 22.
  static constexpr std::uint32_t kNoObject = 0x06020000;
  static constexpr std::uint32_t kNoSubIndex = 0x06090011;

  [[nodiscard]] static bool ReadNumber(std::string_view text, int base, std::uint32_t& into) {
    if (text.starts_with("0x")) {
      text.remove_prefix(2);
      base = 16;
    }
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), into, base);
    return error == std::errc() && end == text.data() + text.size();
  }

  std::map<Place, Object> objects_;
};

// The measuring part of a simulated encoder: a position value of `bits` a turn and `turn_bits` turns, as in object 6004h of
// CiA 406.
struct SimulatedShaftEncoder {
  int bits = 13;
  int turn_bits = 12;
  bool ccw = false;  // counts rise counter-clockwise: code sequence, bit 0 of 6000h
  Shaft shaft;
  std::uint32_t offset = 0;  // 6509h: what a preset adds
  double noise_counts = 0;
  bool stuck = false;
  ShaftAngle stuck_at = 0;

  [[nodiscard]] std::uint64_t range() const { return std::uint64_t{1} << static_cast<unsigned>(bits + turn_bits); }
  [[nodiscard]] std::uint32_t Position(MonoNs at) const {
    return static_cast<std::uint32_t>((Measured(at) + offset) & (range() - 1));
  }
  [[nodiscard]] std::uint32_t NoisyPosition(MonoNs at, SeededRandom& random) const {
    const auto bound = static_cast<std::int64_t>(noise_counts);
    const std::int64_t error = bound == 0 ? 0 : random.Around(bound);
    return static_cast<std::uint32_t>((Position(at) + static_cast<std::uint64_t>(error)) & (range() - 1));
  }
  // Makes the position at `at` read `value`.
  void Preset(std::uint32_t value, MonoNs at) {
    offset = static_cast<std::uint32_t>((value - Measured(at)) & (range() - 1));
  }

 private:
  [[nodiscard]] std::uint64_t Measured(MonoNs at) const {
    const ShaftAngle angle = stuck ? stuck_at : shaft.At(at).angle;
    const std::int64_t counts = (ccw ? angle : -angle) >> static_cast<unsigned>(kTurnBits - bits);
    return static_cast<std::uint64_t>(counts);
  }
};

// A CANopen encoder as CiA 301 and CiA 406 describe it, written from these and not from the driver: NMT state machine,
// boot-up, heartbeat, SDO server for expedited transfers, TPDO1 by event timer or SYNC, emergency messages, preset, stored
// parameters. It ignores what a device ignores, and counts it.
class Cia406Node final : public TableDevice<Cia406Node, SimulatedCanNode> {
 public:
  struct Setup {
    std::uint8_t node = 1;
    int bits = 13;
    int turn_bits = 12;
    bool ccw = false;
    std::uint32_t cob_id = 0x181;
    std::uint8_t transmission = 254;  // 1800h sub 2
    std::uint16_t timer_ms = 100;     // 1800h sub 5
    std::uint16_t heartbeat_ms = 0;   // 1017h
    std::array<std::uint32_t, 4> identity{};
    ShaftAngle angle = 0;
    std::uint64_t seed = 1;
  };
  explicit Cia406Node(const Setup& setup)
      : TableDevice(setup.seed), setup_(setup), dictionary_(DictionaryOf(setup)), stored_(dictionary_) {
    encoder_.bits = setup.bits;
    encoder_.turn_bits = setup.turn_bits;
    encoder_.ccw = setup.ccw;
    encoder_.shaft = Shaft(setup.angle);
  }

  [[nodiscard]] bool present() const override { return state_ != NodeState::kOff; }
  [[nodiscard]] std::int64_t bitrate() const override { return static_cast<std::int64_t>(bitrate_); }
  void OnFrame(const CanFrame& frame, MonoNs now) override {
    CatchUp(now);
    if (!present() || state_ == NodeState::kBooting || fault_.kind == Fault::kOff) return;
    if (frame.id == 0x000) return OnNmt(frame.data, now);
    if (frame.id == 0x080) return OnSync(now);
    if (frame.id == 0x600U + setup_.node) return OnSdo(frame.data, now);
  }
  [[nodiscard]] MonoNs NextDue() const override {
    return std::min({PendingDue(), boot_due_, heartbeat_due_, position_due_});
  }
  void OnDue(MonoNs now, const Send& send) override {
    CatchUp(now);
    if (boot_due_ <= now) EnterPreOperational(std::exchange(boot_due_, kNever));
    if (heartbeat_due_ <= now) {
      QueueLate(heartbeat_due_, {.id = 0x700U + setup_.node, .data = {static_cast<std::uint8_t>(state_)}});
      heartbeat_due_ = std::max(heartbeat_due_, now) + Milliseconds(dictionary_.Get({0x1017, 0}));
    }
    for (int late = 0; position_due_ <= now; ++late) {
      const MonoNs period = Milliseconds(dictionary_.Get({0x1800, 5}));
      if (late == kMaxLate) position_due_ += (now - position_due_) / period * period;
      SendPosition(position_due_);
      position_due_ += period;
    }
    while (const auto next = TakeDue(now)) {
      if (next->frame.id == AnswerId()) answering_ = false;
      if (fault_.kind != Fault::kOff) send(next->frame);
    }
  }
  [[nodiscard]] QuantityList State(MonoNs now) const override {
    Cia406Node node = *this;
    node.Advance(now);
    QuantityList list = node.ShownQuantities();
    const std::uint32_t position = encoder_.Position(node.now_);
    const std::uint32_t turn = std::uint32_t{1} << static_cast<unsigned>(setup_.bits);
    list.emplace_back("angle_deg", NumberText(DegreesFromAngle(encoder_.shaft.At(node.now_).angle)));
    list.emplace_back("single_turn", std::to_string(position & (turn - 1)));
    list.emplace_back("position", std::to_string(position));
    AddCounters(list, {{"positions", counters_.positions},
                       {"syncs", counters_.syncs},
                       {"requests", counters_.requests},
                       {"aborts", counters_.aborts},
                       {"aborted", counters_.aborted},
                       {"overlapping", counters_.overlapping},
                       {"ignored", counters_.ignored},
                       {"resets", counters_.resets},
                       {"presets", counters_.presets},
                       {"saves", counters_.saves}});
    return list;
  }
  [[nodiscard]] static const QuantityTable<Cia406Node>& Table() {
    using N = Cia406Node;
    using Value = std::string_view;
    const auto shaft = [](auto& node) -> auto& { return node.encoder_.shaft; };
    const auto bits = [](std::string_view name, std::uint16_t index) {
      return SimulatedQuantity<N>{name, [index](N& n, Value v) { return n.SetBits(index, v); },
                                  [index](const N& n) {
                                    return Text("0x%04X", n.dictionary_.Get({index, 0}));
                                  }};
    };
    static const QuantityTable<N> kTable = {
        NumberQuantity<N>("bitrate", &N::bitrate_, 0, 1e6, "bit/s (0: as configured)"),
        NumberQuantity<N>("boot_ms", &N::boot_ms_, 0, 60'000, "ms"),
        NumberQuantity<N>("answer_us", &N::answer_us_, 0, 1e7, "us"),
        NumberQuantity<N>("processing_us", &N::processing_us_, 0, 1e6, "us"),
        NumberQuantity<N>("save_ms", &N::save_ms_, 0, 60'000, "ms"),
        {"object", [](N& n, Value v) { return n.SetObject(v); }, nullptr},
        bits("alarms", 0x6503),
        bits("warnings", 0x6505),
        NumberQuantity<N>(
            "noise_counts", [](auto& n) -> auto& { return n.encoder_.noise_counts; }, 0, 1'000, "counts"),
        AccelerationQuantity<N>(shaft),
        MotionQuantity<N>(shaft, &N::now_),
        SpeedQuantity<N>(shaft, &N::now_),
        {"fault", [](N& n, Value v) { return n.SetFault(v); }, [](const N& n) { return FaultText(n.fault_); }},
        {"power", [](N& n, Value v) { return n.SetPower(v); },
         [](const N& n) { return std::string(n.present() ? "on" : "off"); }},
        {"nmt", [](N& n, Value v) { return n.SetNmt(v); }, [](const N& n) { return n.NmtText(); }},
        {"emergency", [](N& n, Value v) { return n.SetEmergency(v); },
         [](const N& n) { return Text("0x%04X", unsigned{n.emergency_}); }},
    };
    return kTable;
  }

  // Counted since the start.
  struct Counters {
    std::int64_t positions = 0;    // TPDO1 sent
    std::int64_t requests = 0;     // accepted SDO requests
    std::int64_t aborts = 0;       // sent
    std::int64_t aborted = 0;      // by the client
    std::int64_t overlapping = 0;  // requests that came before the last was answered
    std::int64_t ignored = 0;      // frames to this node that no device would accept
    std::int64_t syncs = 0;
    std::int64_t resets = 0;
    std::int64_t presets = 0;
    std::int64_t saves = 0;
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  using Place = SimulatedDictionary::Place;
  using Fault = SimulatedFault::Kind;

  // CiA 301 table 22.
  static constexpr std::uint32_t kUnknownCommand = 0x05040001;
  static constexpr std::uint32_t kReadOnlyObject = 0x06010002;
  static constexpr std::uint32_t kTooLong = 0x06070012;
  static constexpr std::uint32_t kTooShort = 0x06070013;
  static constexpr std::uint32_t kInvalidValue = 0x06090030;
  static constexpr std::uint32_t kCannotStore = 0x08000020;

  static constexpr std::uint32_t kSaveValue = 0x65766173;  // "save", 7.5.2.13
  static constexpr std::uint32_t kEncoder = 0x00000196;    // profile 406
  static constexpr std::uint32_t kSingleTurn = 0x00010000;
  static constexpr std::uint32_t kMultiTurn = 0x00020000;
  static constexpr std::uint16_t kScaling = 0x0004;
  // Cyclic frames that a sleeping host receives late; older ones are lost.
  static constexpr int kMaxLate = 64;

  // What Set accepts.
  static constexpr std::array<std::string_view, 3> kPowers = {"on", "off", "cycle"};
  // The names of kNodeStates. The first three can be set.
  static constexpr std::array<std::string_view, 5> kNmtNames = {"pre_operational", "operational", "stopped", "off",
                                                                "booting"};

  [[nodiscard]] static SimulatedDictionary DictionaryOf(const Setup& setup) {
    SimulatedDictionary d;
    const auto constant = [&d](Place place, std::uint8_t bytes, std::uint32_t value) {
      d.Add(place, {.bytes = bytes, .writable = false, .value = value});
    };
    const auto writable = [&d](Place place, std::uint8_t bytes, std::uint32_t value) {
      d.Add(place, {.bytes = bytes, .writable = true, .value = value});
    };
    const auto units = std::uint32_t{1} << static_cast<unsigned>(setup.bits);
    const auto range =
        static_cast<std::uint32_t>(std::uint64_t{1} << static_cast<unsigned>(setup.bits + setup.turn_bits));
    constant({0x1000, 0}, 4, kEncoder | (setup.turn_bits > 0 ? kMultiTurn : kSingleTurn));
    constant({0x1001, 0}, 1, 0);
    constant({0x1008, 0}, 0, 17);  // manufacturer device name, a text
    d.AddRecord(0x1010, 1);
    writable({0x1010, 1}, 4, 1);
    writable({0x1017, 0}, 2, setup.heartbeat_ms);
    d.AddRecord(0x1018, 4);
    for (std::uint8_t part = 0; part < 4; ++part) constant({0x1018, part + 1}, 4, setup.identity.at(part));
    d.AddRecord(0x1800, 5);
    writable({0x1800, 1}, 4, setup.cob_id);
    writable({0x1800, 2}, 1, setup.transmission);
    writable({0x1800, 5}, 2, setup.timer_ms);
    d.AddRecord(0x1A00, 1);
    constant({0x1A00, 1}, 4, 0x60040020);
    constant({0x6000, 0}, 2, kScaling | (setup.ccw ? 1U : 0U));
    constant({0x6001, 0}, 4, units);
    constant({0x6002, 0}, 4, range);
    writable({0x6003, 0}, 4, 0);
    constant({0x6004, 0}, 4, 0);
    constant({0x6500, 0}, 2, kScaling | (setup.ccw ? 1U : 0U));
    constant({0x6501, 0}, 4, units);
    constant({0x6502, 0}, 2, (1U << static_cast<unsigned>(setup.turn_bits)) & 0xFFFFU);
    constant({0x6503, 0}, 2, 0);
    constant({0x6504, 0}, 2, 0x1001);
    constant({0x6505, 0}, 2, 0);
    constant({0x6506, 0}, 2, 0x103F);
    constant({0x6509, 0}, 4, 0);
    return d;
  }
  static void AppendLittleEndian(InlineBytes<kMaxCanData>& data, std::uint32_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; ++i) data.Append(static_cast<std::uint8_t>(value >> 8 * i));
  }
  [[nodiscard]] static MonoNs Milliseconds(std::uint32_t count) {
    return static_cast<MonoNs>(count) * kMillisecond;
  }
  // Table 38 and 7.3.2.2.
  enum class NodeState : std::uint8_t { kOff, kBooting, kStopped = 4, kOperational = 5, kPreOperational = 0x7F };
  static constexpr std::array kNodeStates = {NodeState::kPreOperational, NodeState::kOperational,
                                             NodeState::kStopped, NodeState::kOff, NodeState::kBooting};

  void PowerUp() override { Boot(true); }
  void PowerDown() {
    state_ = NodeState::kOff;
    pending_.clear();
    answering_ = false;
    boot_due_ = heartbeat_due_ = position_due_ = kNever;
  }
  // Reset application restores all stored parameters, reset communication those of the communication profile.
  void Boot(bool application) {
    PowerDown();
    state_ = NodeState::kBooting;
    boot_due_ = now_ + std::llround(boot_ms_ * 1e6);
    dictionary_ = stored_;
    if (application) encoder_.offset = stored_offset_;
  }
  void EnterPreOperational(MonoNs at) {
    state_ = NodeState::kPreOperational;
    QueueLate(at, {.id = 0x700U + setup_.node, .data = {0x00}});
    if (emergency_ != 0) SendEmergency();
    RestartTimers(at);
  }
  void OnNmt(Bytes data, MonoNs now) {
    if (data.size() == 2 && data[1] != 0 && data[1] != setup_.node) return;
    switch (data.size() == 2 ? data[0] : 0) {
      case 0x01:
        state_ = NodeState::kOperational;
        break;
      case 0x02:
        state_ = NodeState::kStopped;
        break;
      case 0x80:
        state_ = NodeState::kPreOperational;
        break;
      case 0x81:
      case 0x82:
        ++counters_.resets;
        return Boot(data[0] == 0x81);
      default:
        ++counters_.ignored;
        return;
    }
    RestartTimers(now);
  }
  void OnSync(MonoNs now) {
    ++counters_.syncs;
    const std::uint32_t type = dictionary_.Get({0x1800, 2});
    if (state_ != NodeState::kOperational || type == 0 || type > 240 || ++syncs_ < type) return;
    syncs_ = 0;
    SendPosition(now);
  }
  void OnSdo(Bytes data, MonoNs now) {
    if (data.size() != 8 || state_ == NodeState::kStopped) {
      ++counters_.ignored;
      return;
    }
    const unsigned specifier = data[0] >> 5U;
    if (specifier == 4) {
      ++counters_.aborted;
      std::erase_if(pending_, [this](const Pending& pending) { return pending.frame.id == AnswerId(); });
      answering_ = false;
      return;
    }
    if (answering_) {
      ++counters_.overlapping;
      return;
    }
    ++counters_.requests;
    const Place place{static_cast<std::uint16_t>(data[1] | data[2] << 8U), data[3]};
    if (specifier == 2) return Upload(place, now);
    if (specifier == 1 && (data[0] & 2U) != 0) return Download(place, data, now);
    Abort(place, kUnknownCommand, now);
  }
  void Upload(Place place, MonoNs now) {
    const SimulatedDictionary::Object* object = dictionary_.Find(place);
    if (object == nullptr) return Abort(place, dictionary_.MissingCode(place), now);
    std::uint32_t value = object->value;
    if (place == Place{0x6004, 0}) value = encoder_.NoisyPosition(now, random_);
    if (place == Place{0x6509, 0}) value = encoder_.offset;
    const auto unused = static_cast<unsigned>(4 - object->bytes);
    const unsigned command = object->bytes == 0 ? 0x41U : 0x43U | unused << 2U;
    Answer(static_cast<std::uint8_t>(command), place, value, now + SlowTime(answer_us_));
  }
  void Download(Place place, Bytes data, MonoNs now) {
    const SimulatedDictionary::Object* object = dictionary_.Find(place);
    if (object == nullptr) return Abort(place, dictionary_.MissingCode(place), now);
    const bool size_given = (data[0] & 1U) != 0;
    const unsigned length = size_given ? 4 - (data[0] >> 2U & 3U) : object->bytes;
    if (!object->writable) return Abort(place, kReadOnlyObject, now);
    if (length != object->bytes) return Abort(place, length > object->bytes ? kTooLong : kTooShort, now);
    std::uint32_t value = 0;
    for (unsigned i = 0; i < length; ++i) value |= static_cast<std::uint32_t>(data[4 + i]) << (8 * i);
    if (const std::uint32_t abort = Write(place, value, now); abort != 0) return Abort(place, abort, now);
    const MonoNs store = place.first == 0x1010 ? std::llround(save_ms_ * 1e6) : 0;
    Answer(0x60, place, 0, now + SlowTime(answer_us_) + store);
  }
  // Returns 0, or the abort code if the value cannot be written.
  [[nodiscard]] std::uint32_t Write(Place place, std::uint32_t value, MonoNs now) {
    if (place.first == 0x1010) {
      if (value != kSaveValue || (dictionary_.Get({0x1010, 1}) & 1U) == 0) return kCannotStore;
      ++counters_.saves;
      stored_ = dictionary_;
      stored_offset_ = encoder_.offset;
      return 0;
    }
    if (place.first == 0x6003) {
      if (value >= encoder_.range()) return kInvalidValue;
      ++counters_.presets;
      encoder_.Preset(value, now);
    }
    dictionary_.Put(place, value);
    if (place.first == 0x1017 || place.first == 0x1800) RestartTimers(now);
    return 0;
  }
  void Answer(std::uint8_t command, Place place, std::uint32_t value, MonoNs at) {
    if (LosesFrame()) return;
    CanFrame frame{.id = AnswerId(), .data = {command}};
    AppendLittleEndian(frame.data, place.first, 2);
    frame.data.Append(place.second);
    AppendLittleEndian(frame.data, value, 4);
    answering_ = true;
    QueueLate(at, Damaged(frame));
  }
  void Abort(Place place, std::uint32_t code, MonoNs now) {
    ++counters_.aborts;
    Answer(0x80, place, code, now + SlowTime(answer_us_));
  }
  void SendPosition(MonoNs sampled) {
    const std::uint32_t cob_id = dictionary_.Get({0x1800, 1});
    const bool lost = LosesFrame();
    if ((cob_id & 0x80000000U) != 0 || lost) return;
    CanFrame frame{.id = cob_id & 0x7FFU, .data = {}};
    AppendLittleEndian(frame.data, encoder_.NoisyPosition(sampled, random_), 4);
    if (dictionary_.Get({0x1A00, 2}) == 0x65030010) AppendLittleEndian(frame.data, dictionary_.Get({0x6503, 0}), 2);
    ++counters_.positions;
    QueueLate(sampled + SlowTime(processing_us_), Damaged(frame));
  }
  void SendEmergency() {
    const auto error_register = static_cast<std::uint8_t>(dictionary_.Get({0x1001, 0}));
    QueueLate(now_, {.id = 0x080U + setup_.node,
                     .data = {static_cast<std::uint8_t>(emergency_), static_cast<std::uint8_t>(emergency_ >> 8U),
                              error_register, 0, 0, 0, 0, 0}});
  }
  void QueueLate(MonoNs due, const CanFrame& frame) {
    Queue(due + (fault_.kind == Fault::kDelayed ? std::llround(fault_.amount * 1e6) : 0), frame);
  }
  void RestartTimers(MonoNs from) {
    const MonoNs heartbeat = Milliseconds(dictionary_.Get({0x1017, 0}));
    heartbeat_due_ = heartbeat > 0 ? from + heartbeat : kNever;
    const MonoNs timer = Milliseconds(dictionary_.Get({0x1800, 5}));
    const bool cyclic = state_ == NodeState::kOperational && dictionary_.Get({0x1800, 2}) >= 254 && timer > 0;
    position_due_ = cyclic ? from + timer : kNever;
    syncs_ = 0;
  }
  [[nodiscard]] MonoNs SlowTime(double usual_us) const {
    return std::llround((usual_us + (fault_.kind == Fault::kSlow ? fault_.amount : 0)) * 1e3);
  }
  [[nodiscard]] std::uint32_t AnswerId() const { return 0x580U + setup_.node; }

  // A wrong state remains after a reset.
  void PutBoth(Place place, std::uint32_t value) {
    dictionary_.Put(place, value);
    stored_.Put(place, value);
  }
  // No node receives a frame that was hit by noise: its CRC is wrong, and it is sent again.
  [[nodiscard]] Result<> SetFault(std::string_view text) {
    const Result<SimulatedFault> fault = ParseFault(text);
    if (!fault) return Failure(fault.error());
    if (fault->kind == Fault::kBitFlip || fault->kind == Fault::kRequestFlip || fault->kind == Fault::kEcho) {
      return Failure(
          "CAN has no such fault: its controllers drop damaged frames and send them again; use intermittent");
    }
    if (fault->kind == Fault::kScattered) return Failure(kNotOnCan);
    fault_ = *fault;
    encoder_.stuck = fault->kind == Fault::kStuck;
    encoder_.stuck_at = encoder_.shaft.At(now_).angle;
    return {};
  }
  [[nodiscard]] Result<> SetPower(std::string_view text) {
    const Result<std::size_t> power = ParseChoice(text, kPowers);
    if (!power) return Failure(power.error());
    if (kPowers.at(*power) != "on") PowerDown();
    if (kPowers.at(*power) != "off" && !present()) Boot(true);
    return {};
  }
  [[nodiscard]] Result<> SetObject(std::string_view text) {
    if (Result<> changed = dictionary_.Change(text); !changed) return changed;
    static_cast<void>(stored_.Change(text));
    RestartTimers(now_);
    return {};
  }
  [[nodiscard]] Result<> SetBits(std::uint16_t index, std::string_view text) {
    const auto bits = ParseWhole(text, 0, 0xFFFF);
    if (!bits) return Failure("'" + std::string(text) + "' is no number from 0 to 0xFFFF");
    PutBoth({index, 0}, static_cast<std::uint32_t>(*bits));
    return {};
  }
  // The error register shows the class of the code; 0 ends the error.
  [[nodiscard]] Result<> SetEmergency(std::string_view text) {
    const auto code = ParseWhole(text, 0, 0xFFFF);
    if (!code) return Failure("'" + std::string(text) + "' is no error code from 0 to 0xFFFF; 0: no error");
    emergency_ = static_cast<std::uint16_t>(*code);
    const unsigned kind = emergency_ >> 12U;
    const unsigned bit = kind >= 2 && kind <= 4 ? 1U << (kind - 1) : 0U;
    PutBoth({0x1001, 0}, emergency_ == 0 ? 0U : 1U | bit);
    if (state_ == NodeState::kPreOperational || state_ == NodeState::kOperational) SendEmergency();
    return {};
  }
  [[nodiscard]] Result<> SetNmt(std::string_view text) {
    const Result<std::size_t> state = ParseChoice(text, std::span(kNmtNames).first(3));
    if (!state) return Failure(state.error());
    if (!present()) return Failure("the node has no power");
    state_ = kNodeStates.at(*state);
    RestartTimers(now_);
    return {};
  }
  [[nodiscard]] std::string NmtText() const {
    const auto* const state = std::find(kNodeStates.begin(), kNodeStates.end(), state_);
    return std::string(kNmtNames.at(static_cast<std::size_t>(state - kNodeStates.begin())));
  }

  const Setup setup_;
  NodeState state_ = NodeState::kBooting;
  SimulatedDictionary dictionary_;
  SimulatedDictionary stored_;  // what a reset restores
  SimulatedShaftEncoder encoder_;
  std::uint32_t stored_offset_ = 0;
  double bitrate_ = 0;
  double boot_ms_ = 50;
  double answer_us_ = 500;
  double processing_us_ = 200;
  double save_ms_ = 300;
  std::uint16_t emergency_ = 0;

  MonoNs boot_due_ = kNever;
  MonoNs heartbeat_due_ = kNever;
  MonoNs position_due_ = kNever;
  std::uint8_t syncs_ = 0;  // since the last synchronous position
  bool answering_ = false;
  Counters counters_;
};

}  // namespace axlecast::cia406
