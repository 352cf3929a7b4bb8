#include "drivers/tformat/simulator.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/kit/simulation/shaft_encoder.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {
namespace {

using Kind = SimulatedFault::Kind;

constexpr MonoNs kAnswerDelay = 3 * kMicrosecond;  // spec 7.1
// On the wire a request ends where no start bit follows a delimiter; an adapter may hand it over in pieces.
constexpr MonoNs kFrameGap = kMillisecond;

// Status field and ALMC as in spec 6.3.2 and Table 3, by bit number.
constexpr unsigned kEa0 = 4;
constexpr unsigned kEa1 = 5;
constexpr unsigned kCa0 = 6;
constexpr unsigned kCa1 = 7;
constexpr std::uint8_t kCommunicationAlarms = 1U << kCa0 | 1U << kCa1;

std::uint8_t Bit(bool value, unsigned number) { return static_cast<std::uint8_t>(unsigned{value} << number); }

std::uint8_t StatusField(const EncoderModel::Reading& reading) {
  const bool ea1 = reading.multi_turn_error || reading.battery_error || reading.battery_alarm;
  return static_cast<std::uint8_t>(Bit(reading.counting_error, kEa0) | Bit(ea1, kEa1));
}

std::uint8_t Almc(const EncoderModel::Reading& reading) {
  return static_cast<std::uint8_t>(Bit(reading.over_speed, 0) | Bit(reading.full_absolute, 1) |
                                   Bit(reading.counting_error, 2) | Bit(reading.counter_overflow, 3) |
                                   Bit(reading.multi_turn_error, 5) | Bit(reading.battery_error, 6) |
                                   Bit(reading.battery_alarm, 7));
}

template <typename Reply>
void AppendLowFirst(Reply& reply, std::uint32_t value) {
  for (unsigned shift = 0; shift < 24; shift += 8) reply.Append(static_cast<std::uint8_t>(value >> shift));
}

template <typename Reply>
void AppendCrc(Reply& reply) {
  std::uint8_t crc = 0;
  for (const std::uint8_t byte : Bytes(reply)) crc = static_cast<std::uint8_t>(crc ^ byte);
  reply.Append(crc);
}

MonoNs Amount(const SimulatedFault& fault, Kind kind, MonoNs unit) {
  return fault.kind == kind ? std::llround(fault.amount * static_cast<double>(unit)) : 0;
}

}  // namespace

TFormatSimulator::TFormatSimulator(std::string device, const SimulatedAxis& axis, Script script, const Line& line)
    : UnitSimulator({{std::move(device), axis, std::move(script)}}), line_(line), random_(line.seed) {}

// ---- events ----

MonoNs TFormatSimulator::NextDue() const {
  return std::min({UnitSimulator::NextDue(), frame_ends_, next_pending_});
}

void TFormatSimulator::OnDue(MonoNs now, const Transmit& transmit) {
  CatchUp(now);
  SendDue(now, transmit);
  FinishFrame(now, transmit);
}

void TFormatSimulator::OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) {
  OnDue(now, transmit);
  if (line_.echo || axis().fault.kind == Kind::kEcho) transmit(bytes);
  if (!baud_fits_) {
    counters_.noise += static_cast<std::int64_t>(bytes.size());
    return;
  }
  if (axis().fault.kind != Kind::kRequestFlip) return Take(bytes, false, now, transmit);
  std::vector<std::uint8_t> damaged(bytes.begin(), bytes.end());
  const bool delimiter_error = FlipBits(damaged, 9, axis().fault.amount, random_);
  Take(damaged, delimiter_error, now, transmit);
}

// ---- requests ----

bool TFormatSimulator::Listens(MonoNs now) const {
  return axis().encoder.Accepts(now) && axis().fault.kind != Kind::kOff;
}

void TFormatSimulator::Take(Bytes bytes, bool delimiter_error, MonoNs now, const Transmit& transmit) {
  if (!Listens(now)) {
    ++counters_.unanswered;
    return;
  }
  if (now < transmitting_until_) return Collide(now);
  delimiter_error_ = delimiter_error_ || delimiter_error;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    frame_.Append(bytes[i]);
    const SimulatedRequest request = CheckRequest(frame_, false);
    switch (request.verdict) {
      case SimulatedRequest::Verdict::kIncomplete:
        frame_ends_ = now + kFrameGap;
        break;
      case SimulatedRequest::Verdict::kNoSync:
        ++counters_.bad_sync;
        frame_.Clear();
        break;
      case SimulatedRequest::Verdict::kAbnormal:
        // What follows without a pause belongs to this frame.
        return Answer(request, now, transmit);
      case SimulatedRequest::Verdict::kGood:
        Answer(request, now, transmit);
        if (i + 1 < bytes.size()) Collide(now);
        return;
    }
  }
}

void TFormatSimulator::FinishFrame(MonoNs now, const Transmit& transmit) {
  if (now < frame_ends_) return;
  if (Listens(now)) {
    Answer(CheckRequest(frame_, true), now, transmit);
  } else {
    frame_.Clear();
    frame_ends_ = kNever;
  }
}

void TFormatSimulator::Answer(const SimulatedRequest& received, MonoNs now, const Transmit& transmit) {
  SimulatedRequest request = received;
  if (delimiter_error_) request.verdict = SimulatedRequest::Verdict::kAbnormal;
  const MonoNs wire_time = line_.byte_time * static_cast<MonoNs>(request.size);
  const MonoNs request_end = axis().pace == Pace::kUnpaced ? now : now + wire_time;
  const ReplyBytes reply = Execute(request, request_end);
  frame_.Clear();
  frame_ends_ = kNever;
  delimiter_error_ = false;
  if (axis().fault.kind == Kind::kIntermittent && random_.Share() < axis().fault.amount) {
    ++counters_.unanswered;
    return;
  }
  Deliver(reply, request_end, now, transmit);
}

void TFormatSimulator::Collide(MonoNs now) {
  ++counters_.collisions;
  frame_.Clear();
  frame_ends_ = kNever;
  delimiter_error_ = false;
  // Two drivers on one line: what is still being sent is lost.
  for (Pending& pending : pending_) {
    if (pending.due != kNever && now < pending.on_wire_until) pending.due = kNever;
  }
}

TFormatSimulator::ReplyBytes TFormatSimulator::Execute(const SimulatedRequest& request, MonoNs at) {
  EncoderModel& encoder = axis().encoder;
  encoder.Advance(at);
  if (request.verdict != SimulatedRequest::Verdict::kGood) {
    ++counters_.abnormal;
    const auto alarms = static_cast<std::uint8_t>(Bit(request.parity_error, kCa0) | Bit(delimiter_error_, kCa1));
    // "transmit the same Request signal again" (spec 6.3.2 (4)): the sequence of a reset continues with it.
    if (alarms == 0) encoder.OnOtherRequest();
    const std::uint8_t field = axis().abnormal_echo ? request.field : TableControlField(0x3);
    return PositionReply(field, 0x3, alarms, at);
  }
  ++counters_.requests;
  if (request.data_id >= 0x6 && request.data_id != 0xD) ++counters_.writes;
  switch (request.data_id) {
    case 0x6:
    case 0xD:
      encoder.OnOtherRequest();
      return EepromReply(request, at);
    case 0x7:
    case 0x8:
    case 0xC: {
      // The reply still shows what was before the reset (spec 9, note).
      const ReplyBytes reply = PositionReply(request.field, request.data_id, 0, at);
      encoder.OnReset(request.data_id, at);
      return reply;
    }
    default:
      encoder.OnOtherRequest();
      return PositionReply(request.field, request.data_id, 0, at);
  }
}

// ---- replies ----

// Spec 6.3.3, Table 2.
TFormatSimulator::ReplyBytes TFormatSimulator::PositionReply(std::uint8_t field, std::uint8_t data_id,
                                                             std::uint8_t alarm_bits, MonoNs at) {
  const EncoderModel::Reading reading = axis().encoder.Read(at);
  ReplyBytes reply;
  reply.Append(field);
  reply.Append(static_cast<std::uint8_t>(StatusField(reading) | (alarm_bits & kCommunicationAlarms)));
  const bool all = data_id == 0x3;
  const bool turns_only = data_id == 0x1;
  const bool id_only = data_id == 0x2;
  if (!turns_only && !id_only) AppendLowFirst(reply, reading.single_turn);
  if (all || id_only) reply.Append(reading.encoder_id);
  if (all || turns_only) AppendLowFirst(reply, reading.multi_turn);
  if (all) reply.Append(Almc(reading));
  AppendCrc(reply);
  return reply;
}

// Spec 6.3.5, Table 4.
TFormatSimulator::ReplyBytes TFormatSimulator::EepromReply(const SimulatedRequest& request, MonoNs at) {
  EncoderEeprom& eeprom = axis().encoder.eeprom();
  const bool busy = eeprom.Busy(at);
  const bool write = request.data_id == 0x6;
  std::uint8_t data = 0;
  if (!busy) data = write ? request.data : eeprom.Read(request.address);
  if (!busy && write) eeprom.Write(request.address, request.data, at);
  ReplyBytes reply;
  reply.Append(request.field);
  reply.Append(static_cast<std::uint8_t>(request.address | Bit(busy, 7)));
  reply.Append(data);
  AppendCrc(reply);
  return reply;
}

void TFormatSimulator::Deliver(ReplyBytes reply, MonoNs request_end, MonoNs now, const Transmit& transmit) {
  const MonoNs later = Amount(axis().fault, Kind::kSlow, kMicrosecond);
  MonoNs sent = now + later;
  if (axis().pace == Pace::kWire) {
    sent = request_end + kAnswerDelay + later + line_.byte_time * static_cast<MonoNs>(reply.size());
  } else if (axis().pace == Pace::kSlots) {
    const MonoNs slot = std::llround(axis().slot_us * 1e3);
    sent = (now + later) / slot * slot + slot;
  }
  transmitting_until_ = sent;

  std::array<std::uint8_t, kLongestReply> bytes{};
  std::copy_n(reply.data(), reply.size(), bytes.begin());
  const std::size_t left = Damage(std::span(bytes.data(), reply.size()), axis().fault, random_);
  reply = ReplyBytes(Bytes(bytes.data(), left));

  const MonoNs due = adapter_.Due(sent, axis().fault, random_);
  if (due <= now) return Send(reply, transmit);
  for (Pending& pending : pending_) {
    if (pending.due != kNever) continue;
    pending = {due, sent, reply};
    next_pending_ = std::min(next_pending_, due);
    return;
  }
  ++counters_.unanswered;  // the adapter's buffer is full
}

void TFormatSimulator::Send(const ReplyBytes& reply, const Transmit& transmit) {
  ++counters_.replies;
  if (!reply.empty()) transmit(reply);
}

void TFormatSimulator::SendDue(MonoNs now, const Transmit& transmit) {
  while (next_pending_ <= now) {
    const auto earlier = [](const Pending& a, const Pending& b) { return a.due < b.due; };
    auto* first = std::min_element(pending_.begin(), pending_.end(), earlier);
    if (first->due > now) {  // what was due collided
      next_pending_ = first->due;
      return;
    }
    first->due = kNever;
    Send(first->bytes, transmit);
    next_pending_ = std::min_element(pending_.begin(), pending_.end(), earlier)->due;
  }
}

TFormatSimulator::CounterList TFormatSimulator::CountersOf(const Unit&) const {
  return {{"requests", counters_.requests},
          {"replies", counters_.replies},
          {"abnormal_requests", counters_.abnormal},
          {"bad_sync", counters_.bad_sync},
          {"unanswered", counters_.unanswered},
          {"collisions", counters_.collisions},
          {"noise", counters_.noise},
          {"writes", counters_.writes}};
}

namespace {

// The encoder that the device's own keys describe.
SimulatedAxis DescribedAxis(const DeviceConfig& device, ConfigMap& map) {
  const auto* described = dynamic_cast<const TFormatSettings*>(device.settings.get());
  const TFormatSettings usual;
  const TFormatSettings& known = described != nullptr ? *described : usual;
  EncoderModel::Settings settings;
  settings.single_turn_bits = static_cast<int>(map.Integer("bits", known.format.single_turn_bits, 6, 24, "bits"));
  settings.multi_turn_bits =
      static_cast<int>(map.Integer("turn_bits", known.format.multi_turn_bits, 0, 24, "bits"));
  if (described != nullptr) settings.encoder_id = known.encoder_id;
  const ShaftStart start = ReadShaftStart(map, settings.multi_turn_bits);
  settings.seed = start.seed;
  SimulatedAxis axis(EncoderModel(settings, start.angle));
  if (!known.battery) axis.encoder.SetBattery(0, 0);
  if (known.identity) {
    std::uint8_t cell = known.identity->address;
    for (const std::uint8_t byte : known.identity->bytes) axis.encoder.eeprom().Preset(cell++, byte);
  }
  return axis;
}

}  // namespace

std::unique_ptr<Simulator> MakeTFormatSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const DeviceConfig& device = bus.devices.front();
  const std::size_t errors = simulate.errors().list().size();
  ConfigMap map = simulate.Named(device.name);
  const SimulatedAxis axis = DescribedAxis(device, map);
  Script script = ReadScriptOf(map, axis);
  if (simulate.errors().list().size() != errors) return nullptr;

  TFormatSimulator::Line line;
  line.echo = bus.link.echo;
  line.seed = axis.encoder.settings().seed;
  line.baud = bus.link.line.baud;
  if (line.baud > 0) line.byte_time = bus.link.line.WireTime(1);
  return std::make_unique<TFormatSimulator>(device.name, axis, std::move(script), line);
}

}  // namespace axlecast::tformat
