#include "drivers/saa_modbus/simulator.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/saa_modbus/family.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {
namespace {

using Kind = SimulatedFault::Kind;

// The manual's steps 1 to 8: one bit after the other.
std::uint16_t CrcCode(Bytes bytes) {
  unsigned slave = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    slave ^= byte;
    for (int bit = 0; bit < 8; ++bit) slave = (slave & 1U) != 0 ? (slave >> 1U) ^ 0xA001U : slave >> 1U;
  }
  return static_cast<std::uint16_t>(slave);
}

void AppendCrc(Frame& frame, bool msb_first = false) {
  const std::uint16_t crc = CrcCode(frame);
  const auto low = static_cast<std::uint8_t>(crc & 0xFFU);
  const auto high = static_cast<std::uint8_t>(crc >> 8U);
  frame.Append(msb_first ? high : low);
  frame.Append(msb_first ? low : high);
}

bool CrcHolds(Bytes frame) {
  if (frame.size() < 4) return false;
  Frame copy(frame.first(frame.size() - 2));
  AppendCrc(copy);
  return copy.data()[copy.size() - 2] == frame[frame.size() - 2] && copy.data()[copy.size() - 1] == frame.back();
}

MonoNs Amount(const SimulatedFault& fault, Kind kind, MonoNs unit) {
  return fault.kind == kind ? std::llround(fault.amount * static_cast<double>(unit)) : 0;
}

// "Definition of Setting" IV to VIII; 0 for another parameter.
std::int64_t RateOf(std::uint8_t parameter) {
  switch (parameter) {
    case 0x24:
      return 2'400;
    case 0x48:
      return 4'800;
    case 0x96:
      return 9'600;
    case 0x19:
      return 19'200;
    case 0x57:
      return 57'600;
    default:
      return 0;
  }
}

}  // namespace

MonoNs SaaModbusSimulator::WireTime(std::size_t characters, std::int64_t baud) const {
  LineFormat format = line_.format;
  format.baud = baud;
  return line_.paced ? format.WireTime(characters) : 0;
}

// "The interval time between the beginning and the end of each frame is at least 3.5 bytes."
MonoNs SaaModbusSimulator::Gap() const { return WireTime(7, line_.format.baud) / 2; }

// ---- events ----

MonoNs SaaModbusSimulator::NextDue() const {
  MonoNs due = std::min(UnitSimulator::NextDue(), frame_ends_);
  for (const Pending& pending : pending_) due = std::min(due, pending.due);
  return due;
}

void SaaModbusSimulator::OnDue(MonoNs now, const Transmit& transmit) {
  CatchUp(now);
  SendDue(now, transmit);
  FinishFrame(now, transmit);
}

void SaaModbusSimulator::OnBaud(std::int64_t baud) {
  host_baud_ = baud;
  line_.format.baud = baud;
}

void SaaModbusSimulator::OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) {
  OnDue(now, transmit);
  const auto echoes = [](const SaaModbusUnit& unit) { return unit.device.fault.kind == Kind::kEcho; };
  if (line_.echo || std::any_of(units().begin(), units().end(), echoes)) transmit(bytes);
  if (line_.paced && frame_.empty() && now < busy_until_ + Gap()) {
    frame_bad_ = true;
    ++short_gaps_;
  }
  const MonoNs begins = std::max(now, frame_.empty() ? now : busy_until_);
  const MonoNs ends = begins + WireTime(bytes.size(), line_.format.baud);
  for (Pending& pending : pending_) {
    if (pending.on_wire.first >= ends || pending.on_wire.last <= begins || pending.destroyed) continue;
    pending.destroyed = true;
    ++units()[pending.unit].counters.collisions;
    frame_bad_ = true;
  }
  const std::size_t taken = std::min(bytes.size(), frame_.room());
  frame_bad_ = frame_bad_ || taken < bytes.size();
  frame_.Append(bytes.first(taken));
  busy_until_ = std::max(busy_until_, ends);
  frame_ends_ = busy_until_ + Gap();
  if (!line_.paced) OnDue(now, transmit);
}

// ---- requests ----

void SaaModbusSimulator::FinishFrame(MonoNs now, const Transmit& transmit) {
  if (now < frame_ends_) return;
  const MonoNs end = frame_ends_;
  frame_ends_ = kNever;
  for (std::size_t i = 0; i < units().size(); ++i) Receive(i, end, now);
  frame_.Clear();
  frame_bad_ = false;
  SendDue(now, transmit);
}

void SaaModbusSimulator::Receive(std::size_t index, MonoNs end, MonoNs now) {
  SaaModbusUnit& unit = units()[index];
  SimulatedEncoder& encoder = unit.device;
  if (!encoder.powered || encoder.fault.kind == Kind::kOff) return;
  if (host_baud_ && *host_baud_ != encoder.baud) {
    ++unit.counters.noise;
    return;
  }
  std::array<std::uint8_t, kMaxFrame> received{};
  std::copy_n(frame_.data(), frame_.size(), received.begin());
  const std::span<std::uint8_t> bytes(received.data(), frame_.size());
  if (encoder.fault.kind == Kind::kRequestFlip) FlipBits(bytes, 8, encoder.fault.amount, encoder.random);
  if (frame_bad_ || !CrcHolds(bytes)) {
    ++unit.counters.bad_crc;
    return;
  }
  const std::optional<Answer> answer = Execute(unit, bytes, std::max(end, now));
  if (!answer) return;
  ++unit.counters.requests;
  if (encoder.fault.kind == Kind::kIntermittent && encoder.random.Share() < encoder.fault.amount) {
    ++unit.counters.unanswered;
    return;
  }
  Reply(index, *answer, line_.paced ? end : now);
}

// 5.1.7 (5), items 1 to 5. The CRC holds.
std::optional<SaaModbusSimulator::Answer> SaaModbusSimulator::Execute(SaaModbusUnit& unit, Bytes frame, MonoNs at) {
  SimulatedEncoder& encoder = unit.device;
  encoder.Advance(at);
  Answer answer{.bytes = {}, .baud = encoder.baud};
  const std::uint8_t function = frame[1];
  if (frame[0] == 0xFF && function == 0xA0 && frame.size() == 4) {
    answer.bytes = {0xFF, 0xA0, encoder.address};
    AppendCrc(answer.bytes, !encoder.query_crc_lsb);
    return answer;
  }
  if (frame[0] != encoder.address) return std::nullopt;
  if (function == 0x03 && frame.size() == 8 && frame[2] == 0 && frame[3] == 0 && frame[4] == 0) {
    const bool wide = encoder.bits > 16;
    const bool two = frame[5] == 2 && (wide || encoder.two_points == SimulatedEncoder::TwoPoints::kPadded);
    const bool one = frame[5] == 1 && !wide;
    if (one || two) {
      const std::uint32_t position = encoder.Position();
      answer.bytes = {encoder.address, 0x03, static_cast<std::uint8_t>(two ? 4 : 2)};
      for (int shift = two ? 24 : 8; shift >= 0; shift -= 8) {
        answer.bytes.Append(static_cast<std::uint8_t>(position >> static_cast<unsigned>(shift)));
      }
      AppendCrc(answer.bytes);
      return answer;
    }
  }
  if (function == 0xA1 && frame.size() == 5 && frame[2] >= 1 && frame[2] <= 247) {
    encoder.address = frame[2];
    ++encoder.writes;
    answer.bytes = {encoder.address, 0xA1};
    AppendCrc(answer.bytes);
    return answer;
  }
  const std::uint8_t parameter = frame[2];
  const std::int64_t rate = RateOf(parameter);
  if (function == 0xCC && frame.size() == 5 && (rate > 0 || parameter <= 0x02)) {
    if (parameter == 0x00) encoder.SetZero();
    if (parameter == 0x01 || parameter == 0x02) encoder.negative = parameter == 0x02;
    if (rate > 0) encoder.baud = rate;
    if (encoder.baud_reply == SimulatedEncoder::BaudReply::kNew) answer.baud = encoder.baud;
    ++encoder.writes;
    answer.bytes = Frame(frame);
    return answer;
  }
  ++unit.counters.ignored;
  return std::nullopt;
}

// ---- replies ----

void SaaModbusSimulator::Reply(std::size_t index, const Answer& answer, MonoNs request_end) {
  SimulatedEncoder& encoder = units()[index].device;
  std::array<std::uint8_t, kMaxFrame> bytes{};
  std::copy_n(answer.bytes.data(), answer.bytes.size(), bytes.begin());
  const std::span<std::uint8_t> reply(bytes.data(), answer.bytes.size());
  const std::size_t left = Damage(reply, encoder.fault, encoder.random);
  Pending pending{.unit = index, .bytes = Frame(Bytes(bytes.data(), left))};
  const MonoNs own_time = line_.paced ? std::llround(encoder.reply_us * 1e3) : 0;
  pending.on_wire.first = request_end + own_time + Amount(encoder.fault, Kind::kSlow, kMicrosecond);
  pending.on_wire.last = pending.on_wire.first + WireTime(answer.bytes.size(), answer.baud);
  pending.due = adapter_.Due(pending.on_wire.last, encoder.fault, encoder.random);
  pending.baud = answer.baud;
  Collide(pending);
  pending_.push_back(pending);
}

void SaaModbusSimulator::Collide(Pending& added) {
  for (Pending& other : pending_) {
    const bool apart = line_.paced
                           ? other.on_wire.first >= added.on_wire.last || other.on_wire.last <= added.on_wire.first
                           : other.on_wire.first != added.on_wire.first;
    if (apart) continue;
    for (Pending* both : {&other, &added}) {
      if (!both->destroyed) ++units()[both->unit].counters.collisions;
      both->destroyed = true;
    }
  }
}

void SaaModbusSimulator::SendDue(MonoNs now, const Transmit& transmit) {
  const auto earlier = [](const Pending& a, const Pending& b) { return a.due < b.due; };
  while (!pending_.empty()) {
    const auto first = std::min_element(pending_.begin(), pending_.end(), earlier);
    if (first->due > now) return;
    SaaModbusUnit& unit = units()[first->unit];
    ++unit.counters.replies;
    busy_until_ = std::max(busy_until_, first->on_wire.last);
    std::vector<std::uint8_t> bytes(first->bytes.data(), first->bytes.data() + first->bytes.size());
    if (first->destroyed || (host_baud_ && *host_baud_ != first->baud)) {
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(unit.device.random.Next());
    }
    pending_.erase(first);
    if (!bytes.empty()) transmit(bytes);
  }
}

SaaModbusSimulator::CounterList SaaModbusSimulator::CountersOf(const SaaModbusUnit& unit) const {
  const SaaModbusUnit::Counters& own = unit.counters;
  return {{"requests", own.requests},     {"replies", own.replies},   {"ignored", own.ignored},
          {"bad_crc", own.bad_crc},       {"noise", own.noise},       {"unanswered", own.unanswered},
          {"collisions", own.collisions}, {"short_gaps", short_gaps_}};
}

namespace {

// The encoder that the device's own keys describe, as the configuration expects to find it.
SaaModbusUnit MakeUnit(const BusConfig& bus, const DeviceConfig& device, ConfigMap map) {
  const auto& settings = static_cast<const SaaModbusSettings&>(*device.settings);
  const auto bits = static_cast<int>(map.Integer("bits", settings.bits, 10, 26, "bits"));  // SAA manual 4.1
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  SimulatedEncoder encoder(bits, seed);
  encoder.address = settings.address;
  encoder.baud = bus.link.line.baud;
  encoder.shaft = Shaft(AngleFromDegrees(map.Number("start_deg", 0, 0, 360, "deg")));
  return {{device.name, encoder, ReadScriptOf(map, encoder)}, {}};
}

}  // namespace

std::unique_ptr<Simulator> MakeSaaModbusSimulator(const BusConfig& bus, ConfigMap& simulate) {
  const std::size_t errors = simulate.errors().list().size();
  SaaModbusSimulator::Line line{.format = bus.link.line, .echo = bus.link.echo};
  line.paced = simulate.Choice("pace", {"wire", "unpaced"}, 0) == 0;
  std::vector<SaaModbusUnit> units;
  for (const DeviceConfig& device : bus.devices) {
    units.push_back(MakeUnit(bus, device, simulate.Named(device.name)));
  }
  if (simulate.errors().list().size() != errors) return nullptr;
  return std::make_unique<SaaModbusSimulator>(line, std::move(units));
}

}  // namespace axlecast::saa_modbus
