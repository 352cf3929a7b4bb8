#include "drivers/cia406/simulator/cia406_node.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft.h"

namespace axlecast::cia406 {
namespace {

using Access = SimulatedDictionary::Access;
using Kind = SimulatedFault::Kind;

// CiA 301 table 22.
constexpr std::uint32_t kUnknownCommand = 0x05040001;
constexpr std::uint32_t kInvalidValue = 0x06090030;
constexpr std::uint32_t kCannotStore = 0x08000020;

constexpr std::uint32_t kSave = 0x65766173;     // "save", 7.5.2.13
constexpr std::uint32_t kEncoder = 0x00000196;  // profile 406
constexpr std::uint32_t kSingleTurn = 0x00010000;
constexpr std::uint32_t kMultiTurn = 0x00020000;
constexpr std::uint16_t kScaling = 0x0004;
// Cyclic frames that a sleeping host is served late; older ones nobody hears any more.
constexpr int kMaxLate = 64;

SimulatedDictionary DictionaryOf(const Cia406Node::Setup& setup) {
  SimulatedDictionary d;
  const auto constant = [&d](std::uint16_t index, std::uint8_t sub, std::uint8_t bytes, std::uint32_t value) {
    d.Add({.index = index, .sub = sub, .bytes = bytes, .access = Access::kReadOnly, .value = value});
  };
  const auto writable = [&d](std::uint16_t index, std::uint8_t sub, std::uint8_t bytes, std::uint32_t value) {
    d.Add({.index = index, .sub = sub, .bytes = bytes, .access = Access::kWritable, .value = value});
  };
  const auto units = std::uint32_t{1} << static_cast<unsigned>(setup.bits);
  const auto range =
      static_cast<std::uint32_t>(std::uint64_t{1} << static_cast<unsigned>(setup.bits + setup.turn_bits));
  constant(0x1000, 0, 4, kEncoder | (setup.turn_bits > 0 ? kMultiTurn : kSingleTurn));
  constant(0x1001, 0, 1, 0);
  constant(0x1008, 0, 0, 17);  // manufacturer device name, a text
  d.AddRecord(0x1010, 1);
  writable(0x1010, 1, 4, 1);
  writable(0x1017, 0, 2, setup.heartbeat_ms);
  d.AddRecord(0x1018, 4);
  for (std::uint8_t part = 0; part < 4; ++part)
    constant(0x1018, static_cast<std::uint8_t>(part + 1), 4, setup.identity.at(part));
  d.AddRecord(0x1800, 5);
  writable(0x1800, 1, 4, setup.cob_id);
  writable(0x1800, 2, 1, setup.transmission);
  writable(0x1800, 5, 2, setup.timer_ms);
  d.AddRecord(0x1A00, 1);
  constant(0x1A00, 1, 4, 0x60040020);
  constant(0x6000, 0, 2, kScaling | (setup.ccw ? 1U : 0U));
  constant(0x6001, 0, 4, units);
  constant(0x6002, 0, 4, range);
  writable(0x6003, 0, 4, 0);
  constant(0x6004, 0, 4, 0);
  constant(0x6500, 0, 2, kScaling | (setup.ccw ? 1U : 0U));
  constant(0x6501, 0, 4, units);
  constant(0x6502, 0, 2, (1U << static_cast<unsigned>(setup.turn_bits)) & 0xFFFFU);
  constant(0x6503, 0, 2, 0);
  constant(0x6504, 0, 2, 0x1001);
  constant(0x6505, 0, 2, 0);
  constant(0x6506, 0, 2, 0x103F);
  constant(0x6509, 0, 4, 0);
  return d;
}

MonoNs Milliseconds(std::uint32_t count) { return static_cast<MonoNs>(count) * kMillisecond; }

}  // namespace

Cia406Node::Cia406Node(const Setup& setup)
    : setup_(setup), dictionary_(DictionaryOf(setup)), stored_(dictionary_), random_(setup.seed) {
  encoder_.bits = setup.bits;
  encoder_.turn_bits = setup.turn_bits;
  encoder_.ccw = setup.ccw;
  encoder_.shaft = Shaft(setup.angle);
}

// ---- time ----

void Cia406Node::Advance(MonoNs now) { now_ = std::max(now_, now); }

void Cia406Node::CatchUp(MonoNs now) {
  if (!started_) {
    started_ = true;
    now_ = now;
    script_.Start(*this, now);
    if (present()) Boot(true);
  }
  script_.Run(*this, now);
  Advance(now);
}

MonoNs Cia406Node::NextDue() const {
  if (!started_) return 0;
  MonoNs due = std::min({script_.NextDue(), boot_due_, heartbeat_due_, position_due_});
  for (const Pending& pending : pending_) due = std::min(due, pending.due);
  return due;
}

void Cia406Node::OnDue(MonoNs now, const Send& send) {
  CatchUp(now);
  if (boot_due_ <= now) EnterPreOperational(std::exchange(boot_due_, kNever));
  if (heartbeat_due_ <= now) {
    Queue(heartbeat_due_, {.id = 0x700U + setup_.node, .data = {static_cast<std::uint8_t>(state_)}});
    heartbeat_due_ = std::max(heartbeat_due_, now) + Milliseconds(dictionary_.Get(0x1017, 0));
  }
  for (int late = 0; position_due_ <= now; ++late) {
    const MonoNs period = Milliseconds(dictionary_.Get(0x1800, 5));
    if (late == kMaxLate) position_due_ += (now - position_due_) / period * period;
    SendPosition(position_due_);
    position_due_ += period;
  }
  std::stable_sort(pending_.begin(), pending_.end(),
                   [](const Pending& a, const Pending& b) { return a.due < b.due; });
  while (!pending_.empty() && pending_.front().due <= now) {
    const Pending next = pending_.front();
    pending_.erase(pending_.begin());
    if (next.answer) answering_ = false;
    if (fault_.kind != Kind::kOff) send(next.frame);
  }
}

void Cia406Node::Queue(MonoNs due, const CanFrame& frame, bool answer) {
  const MonoNs held = fault_.kind == Kind::kDelayed ? std::llround(fault_.amount * 1e6) : 0;
  pending_.push_back({due + held, frame, answer});
}

// ---- power and network management: 7.3.2 ----

void Cia406Node::Power(bool on) {
  if (on == present()) return;
  if (on) return Boot(true);
  state_ = NodeState::kOff;
  pending_.clear();
  answering_ = false;
  boot_due_ = heartbeat_due_ = position_due_ = kNever;
}

// Reset application brings back all stored parameters, reset communication those of the communication profile.
void Cia406Node::Boot(bool application) {
  state_ = NodeState::kBooting;
  pending_.clear();
  answering_ = false;
  heartbeat_due_ = position_due_ = kNever;
  boot_due_ = now_ + std::llround(boot_ms_ * 1e6);
  dictionary_ = stored_;
  if (application) encoder_.offset = stored_offset_;
}

void Cia406Node::EnterPreOperational(MonoNs at) {
  state_ = NodeState::kPreOperational;
  Queue(at, {.id = 0x700U + setup_.node, .data = {0x00}});
  if (emergency_ != 0) SendEmergency();
  RestartTimers(at);
}

void Cia406Node::RestartTimers(MonoNs from) {
  const MonoNs heartbeat = Milliseconds(dictionary_.Get(0x1017, 0));
  heartbeat_due_ = heartbeat > 0 ? from + heartbeat : kNever;
  const MonoNs timer = Milliseconds(dictionary_.Get(0x1800, 5));
  const bool cyclic = state_ == NodeState::kOperational && dictionary_.Get(0x1800, 2) >= 254 && timer > 0;
  position_due_ = cyclic ? from + timer : kNever;
  syncs_ = 0;
}

void Cia406Node::OnFrame(const CanFrame& frame, MonoNs now) {
  CatchUp(now);
  if (!present() || state_ == NodeState::kBooting || fault_.kind == Kind::kOff) return;
  if (frame.id == 0x000) return OnNmt(frame, now);
  if (frame.id == 0x080) return OnSync(now);
  if (frame.id == 0x600U + setup_.node) return OnSdo(frame, now);
}

void Cia406Node::OnNmt(const CanFrame& frame, MonoNs now) {
  const Bytes data = frame.data;
  if (data.size() != 2) {
    ++counters_.ignored;
    return;
  }
  if (data[1] != 0 && data[1] != setup_.node) return;
  switch (data[0]) {
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

// ---- positions: 7.2.2 ----

void Cia406Node::OnSync(MonoNs now) {
  ++counters_.syncs;
  const std::uint32_t type = dictionary_.Get(0x1800, 2);
  if (state_ != NodeState::kOperational || type == 0 || type > 240 || ++syncs_ < type) return;
  syncs_ = 0;
  SendPosition(now);
}

void Cia406Node::SendPosition(MonoNs sampled) {
  const std::uint32_t cob_id = dictionary_.Get(0x1800, 1);
  const bool lost = fault_.kind == Kind::kIntermittent && random_.Share() < fault_.amount;
  if ((cob_id & 0x80000000U) != 0 || lost) return;
  const std::uint32_t position = encoder_.NoisyPosition(sampled, random_);
  std::vector<std::uint8_t> data;
  for (unsigned shift = 0; shift < 32; shift += 8) data.push_back(static_cast<std::uint8_t>(position >> shift));
  if (dictionary_.Get(0x1A00, 2) == 0x65030010) {
    const std::uint32_t alarms = dictionary_.Get(0x6503, 0);
    data.push_back(static_cast<std::uint8_t>(alarms));
    data.push_back(static_cast<std::uint8_t>(alarms >> 8U));
  }
  data.resize(Damage(std::span(data), fault_, random_));
  const double slow_us = fault_.kind == Kind::kSlow ? fault_.amount : 0;
  CanFrame frame{.id = cob_id & 0x7FFU, .data = {}};
  frame.data.Append(Bytes(data));
  ++counters_.positions;
  Queue(sampled + std::llround((processing_us_ + slow_us) * 1e3), frame);
}

// ---- emergency: 7.2.7 ----

void Cia406Node::SendEmergency() {
  const auto error_register = static_cast<std::uint8_t>(dictionary_.Get(0x1001, 0));
  Queue(now_, {.id = 0x080U + setup_.node,
               .data = {static_cast<std::uint8_t>(emergency_), static_cast<std::uint8_t>(emergency_ >> 8U),
                        error_register, 0, 0, 0, 0, 0}});
}

// ---- service data: 7.2.4 ----

MonoNs Cia406Node::AnswerTime() const {
  const double slow_us = fault_.kind == Kind::kSlow ? fault_.amount : 0;
  return std::llround((answer_us_ + slow_us) * 1e3);
}

void Cia406Node::OnSdo(const CanFrame& frame, MonoNs now) {
  const Bytes data = frame.data;
  if (data.size() != 8 || state_ == NodeState::kStopped) {
    ++counters_.ignored;
    return;
  }
  const unsigned specifier = data[0] >> 5U;
  if (specifier == 4) {
    ++counters_.aborted;
    std::erase_if(pending_, [](const Pending& pending) { return pending.answer; });
    answering_ = false;
    return;
  }
  if (answering_) {
    ++counters_.overlapping;
    return;
  }
  ++counters_.requests;
  const auto index = static_cast<std::uint16_t>(data[1] | data[2] << 8U);
  if (specifier == 2) return Upload(index, data[3], now);
  if (specifier == 1 && (data[0] & 2U) != 0) return Download(frame, now);
  Abort(index, data[3], kUnknownCommand, now);
}

void Cia406Node::Upload(std::uint16_t index, std::uint8_t sub, MonoNs now) {
  const SimulatedDictionary::Found found = dictionary_.Read(index, sub);
  if (found.object == nullptr) return Abort(index, sub, found.abort, now);
  if (found.object->bytes == 0) return Answer(0x41, index, sub, found.object->value, now + AnswerTime());
  const auto unused = static_cast<unsigned>(4 - found.object->bytes);
  Answer(static_cast<std::uint8_t>(0x43U | unused << 2U), index, sub, Value(index, sub, now), now + AnswerTime());
}

std::uint32_t Cia406Node::Value(std::uint16_t index, std::uint8_t sub, MonoNs now) {
  if (index == 0x6004) return encoder_.NoisyPosition(now, random_);
  if (index == 0x6509) return encoder_.offset;
  return dictionary_.Get(index, sub);
}

void Cia406Node::Download(const CanFrame& frame, MonoNs now) {
  const Bytes data = frame.data;
  const auto index = static_cast<std::uint16_t>(data[1] | data[2] << 8U);
  const std::uint8_t sub = data[3];
  const bool size_said = (data[0] & 1U) != 0;
  const auto bytes = static_cast<std::uint8_t>(4 - (data[0] >> 2U & 3U));
  const SimulatedDictionary::Found there = dictionary_.Read(index, sub);
  const std::uint8_t length = size_said || there.object == nullptr ? bytes : there.object->bytes;
  const SimulatedDictionary::Found found = dictionary_.Check(index, sub, length);
  if (found.object == nullptr) return Abort(index, sub, found.abort, now);
  std::uint32_t value = 0;
  for (unsigned i = 0; i < length; ++i) value |= static_cast<std::uint32_t>(data[4 + i]) << (8 * i);
  const std::uint32_t abort = Write(index, sub, value, now);
  if (abort != 0) return Abort(index, sub, abort, now);
  const MonoNs store = index == 0x1010 ? std::llround(save_ms_ * 1e6) : 0;
  Answer(0x60, index, sub, 0, now + AnswerTime() + store);
}

// 0, or why the value cannot be written.
std::uint32_t Cia406Node::Write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, MonoNs now) {
  if (index == 0x1010) {
    if (value != kSave || (dictionary_.Get(0x1010, 1) & 1U) == 0) return kCannotStore;
    ++counters_.saves;
    stored_ = dictionary_;
    stored_offset_ = encoder_.offset;
    return 0;
  }
  if (index == 0x6003) {
    if (value >= encoder_.range()) return kInvalidValue;
    ++counters_.presets;
    encoder_.Preset(value, now);
  }
  dictionary_.Put(index, sub, value);
  if (index == 0x1017 || index == 0x1800) RestartTimers(now);
  return 0;
}

void Cia406Node::Answer(std::uint8_t command, std::uint16_t index, std::uint8_t sub, std::uint32_t value,
                        MonoNs at) {
  const bool lost = fault_.kind == Kind::kIntermittent && random_.Share() < fault_.amount;
  if (lost) return;
  std::vector<std::uint8_t> data = {command, static_cast<std::uint8_t>(index),
                                    static_cast<std::uint8_t>(index >> 8U), sub};
  for (unsigned shift = 0; shift < 32; shift += 8) data.push_back(static_cast<std::uint8_t>(value >> shift));
  data.resize(Damage(std::span(data), fault_, random_));
  CanFrame frame{.id = 0x580U + setup_.node, .data = {}};
  frame.data.Append(Bytes(data));
  answering_ = true;
  Queue(at, frame, true);
}

void Cia406Node::Abort(std::uint16_t index, std::uint8_t sub, std::uint32_t code, MonoNs now) {
  ++counters_.aborts;
  Answer(0x80, index, sub, code, now + AnswerTime());
}

// What can be set of a node.
struct NodeQuantities {
  using N = Cia406Node;
  using Text = std::string_view;
  using Kind = SimulatedFault::Kind;

  static const QuantityTable<N>& Table();

  // A frame that was hit by noise reaches nobody: its CRC is wrong, and it is sent again.
  static std::string SetFault(N& n, Text value) {
    SimulatedFault fault;
    std::string problem = ParseFault(value, fault);
    if (!problem.empty()) return problem;
    if (fault.kind == Kind::kBitFlip || fault.kind == Kind::kRequestFlip || fault.kind == Kind::kEcho) {
      return "CAN has no such fault: its controllers drop damaged frames and send them again; use intermittent";
    }
    if (fault.kind == Kind::kScattered) return kNotOnCan;
    n.fault_ = fault;
    n.encoder_.stuck = fault.kind == Kind::kStuck;
    n.encoder_.stuck_at = n.encoder_.shaft.At(n.now_).angle;
    return {};
  }
  static std::string SetPower(N& n, Text value) {
    if (value != "on" && value != "off" && value != "cycle")
      return "'" + std::string(value) + "' is none of on, off, cycle";
    if (value != "on") n.Power(false);
    if (value != "off") n.Power(true);
    return {};
  }
  static std::string SetObject(N& n, Text value) {
    std::string problem = n.dictionary_.Change(value);
    if (!problem.empty()) return problem;
    static_cast<void>(n.stored_.Change(value));
    n.RestartTimers(n.now_);
    return {};
  }
  // What is wrong stays wrong through a reset.
  static void PutBoth(N& n, std::uint16_t index, std::uint32_t value) {
    n.dictionary_.Put(index, 0, value);
    n.stored_.Put(index, 0, value);
  }
  static std::string SetBits(N& n, std::uint16_t index, Text value) {
    const auto bits = ParseWhole(value, 0, 0xFFFF);
    if (!bits) return "'" + std::string(value) + "' is no number from 0 to 0xFFFF";
    PutBoth(n, index, static_cast<std::uint32_t>(*bits));
    return {};
  }
  // The error register says what the code's class is; 0 ends the error.
  static std::string SetEmergency(N& n, Text value) {
    const auto code = ParseWhole(value, 0, 0xFFFF);
    if (!code) return "'" + std::string(value) + "' is no error code from 0 to 0xFFFF; 0: no error";
    n.emergency_ = static_cast<std::uint16_t>(*code);
    const unsigned kind = n.emergency_ >> 12U;
    const unsigned bit = kind >= 2 && kind <= 4 ? 1U << (kind - 1) : 0U;
    PutBoth(n, 0x1001, n.emergency_ == 0 ? 0U : 1U | bit);
    if (n.state_ == N::NodeState::kPreOperational || n.state_ == N::NodeState::kOperational) n.SendEmergency();
    return {};
  }
  static std::string SetNmt(N& n, Text value) {
    if (value != "pre_operational" && value != "operational" && value != "stopped") {
      return "'" + std::string(value) + "' is none of pre_operational, operational, stopped";
    }
    if (!n.present()) return "the node has no power";
    n.state_ = value == "stopped"       ? N::NodeState::kStopped
               : value == "operational" ? N::NodeState::kOperational
                                        : N::NodeState::kPreOperational;
    n.RestartTimers(n.now_);
    return {};
  }
  static std::string NmtText(const N& n) {
    switch (n.state_) {
      case N::NodeState::kOff:
        return "off";
      case N::NodeState::kBooting:
        return "booting";
      case N::NodeState::kStopped:
        return "stopped";
      case N::NodeState::kOperational:
        return "operational";
      case N::NodeState::kPreOperational:
        break;
    }
    return "pre_operational";
  }
};

const QuantityTable<Cia406Node>& NodeQuantities::Table() {
  static const QuantityTable<N> kTable = {
      {"bitrate", [](N& n, Text v) { return ReadNumber(v, 0, 1e6, "bit/s (0: as configured)", n.bitrate_); },
       [](const N& n) { return NumberText(n.bitrate_); }},
      {"boot_ms", [](N& n, Text v) { return ReadNumber(v, 0, 60'000, "ms", n.boot_ms_); },
       [](const N& n) { return NumberText(n.boot_ms_); }},
      {"answer_us", [](N& n, Text v) { return ReadNumber(v, 0, 1e7, "us", n.answer_us_); },
       [](const N& n) { return NumberText(n.answer_us_); }},
      {"processing_us", [](N& n, Text v) { return ReadNumber(v, 0, 1e6, "us", n.processing_us_); },
       [](const N& n) { return NumberText(n.processing_us_); }},
      {"save_ms", [](N& n, Text v) { return ReadNumber(v, 0, 60'000, "ms", n.save_ms_); },
       [](const N& n) { return NumberText(n.save_ms_); }},
      {"object", SetObject, nullptr},
      {"alarms", [](N& n, Text v) { return SetBits(n, 0x6503, v); },
       [](const N& n) { return axlecast::Text("0x%04X", n.dictionary_.Get(0x6503, 0)); }},
      {"warnings", [](N& n, Text v) { return SetBits(n, 0x6505, v); },
       [](const N& n) { return axlecast::Text("0x%04X", n.dictionary_.Get(0x6505, 0)); }},
      {"noise_counts", [](N& n, Text v) { return ReadNumber(v, 0, 1'000, "counts", n.encoder_.noise_counts); },
       [](const N& n) { return NumberText(n.encoder_.noise_counts); }},
      {"accel_rad_s2", [](N& n, Text v) { return OrderAcceleration(n.encoder_.shaft, v); },
       [](const N& n) { return NumberText(n.encoder_.shaft.acceleration_rad_s2()); }},
      {"motion", [](N& n, Text v) { return OrderMotion(n.encoder_.shaft, v, n.now_, n.motion_); },
       [](const N& n) { return n.motion_; }},
      {"speed_rpm", [](N& n, Text v) { return OrderSpeed(n.encoder_.shaft, v, n.now_, n.motion_); },
       [](const N& n) { return NumberText(n.encoder_.shaft.At(n.now_).speed_rpm); }},
      {"fault", SetFault, [](const N& n) { return FaultText(n.fault_); }},
      {"power", SetPower, [](const N& n) { return std::string(n.present() ? "on" : "off"); }},
      {"nmt", SetNmt, NmtText},
      {"emergency", SetEmergency, [](const N& n) { return axlecast::Text("0x%04X", unsigned{n.emergency_}); }},
  };
  return kTable;
}

const std::vector<std::string_view>& Cia406Node::QuantityNames() {
  static const std::vector<std::string_view> kNames = NamesOf(NodeQuantities::Table());
  return kNames;
}

Result<> Cia406Node::Set(std::string_view name, std::string_view value) {
  return SetByName(NodeQuantities::Table(), *this, name, value);
}

std::vector<std::pair<std::string, std::string>> Cia406Node::State(MonoNs now) const {
  Cia406Node there = *this;
  there.Advance(now);
  std::vector<std::pair<std::string, std::string>> list = Shown(NodeQuantities::Table(), there);
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(encoder_.shaft.At(there.now_).angle)));
  const std::uint32_t turn = std::uint32_t{1} << static_cast<unsigned>(there.setup_.bits);
  list.emplace_back("single_turn", std::to_string(encoder_.Position(there.now_) & (turn - 1)));
  list.emplace_back("position", std::to_string(encoder_.Position(there.now_)));
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  count("positions", counters_.positions);
  count("syncs", counters_.syncs);
  count("requests", counters_.requests);
  count("aborts", counters_.aborts);
  count("aborted", counters_.aborted);
  count("overlapping", counters_.overlapping);
  count("ignored", counters_.ignored);
  count("resets", counters_.resets);
  count("presets", counters_.presets);
  count("saves", counters_.saves);
  return list;
}

}  // namespace axlecast::cia406
