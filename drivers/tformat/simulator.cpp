#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft_encoder.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"
#include "drivers/tformat/encoder_model.h"
#include "drivers/tformat/family.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {
namespace {

// ---- the encoder and its quantities ----

// When a reply reaches the host.
enum class Pace : std::uint8_t {
  kUnpaced,  // at once
  kWire,     // when its last bit would end on the wire
  kSlots,    // at the next multiple of the slot on CLOCK_MONOTONIC
};

// A simulated encoder and its line, with all that a file, a script or an operator can set.
struct SimulatedAxis final : TableDevice<SimulatedAxis> {
  explicit SimulatedAxis(EncoderModel model) : encoder(std::move(model)) {}

  void Advance(MonoNs now) override { encoder.Advance(now); }
  [[nodiscard]] static const QuantityTable<SimulatedAxis>& Table();
  // Every quantity with its present value, then what the encoder measures and what was done to it.
  [[nodiscard]] QuantityList Quantities() const;

  EncoderModel encoder;
  SimulatedFault fault;
  Pace pace = Pace::kWire;
  double slot_us = 51;         // spec: 4 us request, 3 us, 44 us reply of data ID 3
  bool abnormal_echo = false;  // an abnormal request is answered with its own control field, not with data ID 3's
};

constexpr double kMaxVolts = 4.75;  // spec 5.3

using Text = std::string_view;

Result<> SetPower(SimulatedAxis& axis, Text value) {
  constexpr std::array<Text, 3> kWords = {"on", "off", "cycle"};
  const Result<std::size_t> word = ParseChoice(value, kWords);
  if (!word) return Failure(word.error());
  const MonoNs now = axis.encoder.now();
  if (value != "on") axis.encoder.SetPower(false, now);
  if (value != "off") axis.encoder.SetPower(true, now);
  return {};
}

Result<> SetBattery(SimulatedAxis& axis, Text value) {
  const Result<double> volts = ParseNumber(value, 0, kMaxVolts, "V (0: no battery)");
  if (!volts) return Failure(volts.error());
  axis.encoder.SetBattery(*volts, axis.encoder.now());
  return {};
}

constexpr std::array<Text, 3> kCountingErrors = {"none", "live", "latched"};

Result<> SetCountingError(SimulatedAxis& axis, Text value) {
  const Result<std::size_t> error = ParseChoice(value, kCountingErrors);
  if (!error) return Failure(error.error());
  axis.encoder.SetCountingError(static_cast<EncoderModel::CountingError>(*error), axis.encoder.now());
  return {};
}

Result<> SetJump(SimulatedAxis& axis, Text value) {
  const Result<std::int64_t> turns = ParseWholeNumber(value, -65'535, 65'535, "turns");
  if (!turns) return Failure(turns.error());
  if (*turns != 0) axis.encoder.JumpTurns(*turns, axis.encoder.now());
  return {};
}

Result<> SetEncoderId(SimulatedAxis& axis, Text value) {
  const std::optional<std::int64_t> id = ParseWhole(value, 0, 0xFF);
  if (!id) return Failure("'" + std::string(value) + "' is not 0 to 255 or 0x00 to 0xff");
  axis.encoder.settings().encoder_id = static_cast<std::uint8_t>(*id);
  return {};
}

// "72=A1 05": bytes in hex from a cell on.
Result<> SetEeprom(SimulatedAxis& axis, Text value) {
  const std::size_t equals = value.find('=');
  const auto cell = ParseWhole(value.substr(0, equals), 0, EncoderEeprom::kCells - 1);
  const auto bytes = ParseHex(equals == Text::npos ? Text() : value.substr(equals + 1));
  if (!cell || !bytes || static_cast<std::size_t>(*cell) + bytes->size() > EncoderEeprom::kCells) {
    return Failure("'" + std::string(value) + "' is not CELL=BYTES with cells 0 to 79, e.g. 72=A1 05");
  }
  auto at = static_cast<std::uint8_t>(*cell);
  for (const std::uint8_t byte : *bytes) axis.encoder.eeprom().Preset(at++, byte);
  return {};
}

Result<> SetWear(SimulatedAxis& axis, Text value) {
  const Result<std::int64_t> writes = ParseWholeNumber(value, 0, 1e9, "writes");
  if (!writes) return Failure(writes.error());
  axis.encoder.eeprom().SetWear(*writes);
  return {};
}

Result<> SetFault(SimulatedAxis& axis, Text value) {
  const Result<SimulatedFault> fault = ParseFault(value);
  if (!fault) return Failure(fault.error());
  axis.fault = *fault;
  axis.encoder.SetStuck(fault->kind == SimulatedFault::Kind::kStuck, axis.encoder.now());
  return {};
}

// The cells that hold something, as SetEeprom takes them if they are in one row.
std::string EepromText(const SimulatedAxis& axis) {
  constexpr Text kDigits = "0123456789ABCDEF";
  std::string text;
  std::uint8_t next = EncoderEeprom::kCells;
  for (std::uint8_t cell = 0; cell < EncoderEeprom::kCells; ++cell) {
    const std::uint8_t byte = axis.encoder.eeprom().Read(cell);
    if (byte == 0) continue;
    if (cell != next) text += (text.empty() ? "" : ", ") + std::to_string(cell) + '=';
    if (cell == next) text += ' ';
    text += {kDigits[byte >> 4U], kDigits[byte & 0xFU]};
    next = static_cast<std::uint8_t>(cell + 1);
  }
  return text;
}

std::string AlarmText(const EncoderModel::Reading& reading) {
  const std::array<std::pair<bool, Text>, 7> flags = {{{reading.over_speed, "OS"},
                                                       {reading.full_absolute, "FS"},
                                                       {reading.counting_error, "CE"},
                                                       {reading.counter_overflow, "OF"},
                                                       {reading.multi_turn_error, "ME"},
                                                       {reading.battery_error, "BE"},
                                                       {reading.battery_alarm, "BA"}}};
  std::string text;
  for (const auto& [raised, name] : flags) {
    if (raised) text += (text.empty() ? "" : " ") + std::string(name);
  }
  return text.empty() ? "none" : text;
}

// Power and motion come last: they begin after the rest of the mapping is set.
const QuantityTable<SimulatedAxis>& SimulatedAxis::Table() {
  using A = SimulatedAxis;
  constexpr auto kSettings = [](auto& a) -> auto& { return a.encoder.settings(); };
  static const QuantityTable<A> kTable = {
      ChoiceQuantity<A>("pace", &A::pace, {"unpaced", "wire", "slots"}),
      NumberQuantity<A>("slot_us", &A::slot_us, 1, 1e6, "us"),
      {"enid", SetEncoderId, [](const A& a) { return std::to_string(a.encoder.settings().encoder_id); }},
      ChoiceQuantity<A>("abnormal_echo", &A::abnormal_echo, {"id3", "request"}),
      WholeQuantity<A>(
          "noise_counts", [=](auto& a) -> auto& { return kSettings(a).noise_counts; }, 0, 1000, "counts"),
      NumberQuantity<A>(
          "zero_error_deg", [=](auto& a) -> auto& { return kSettings(a).zero_error_deg; }, -10, 10,
          "deg (the maker allows 0.35)"),
      {"eeprom", SetEeprom, EepromText},
      {"eeprom_wear", SetWear, [](const A& a) { return std::to_string(a.encoder.eeprom().wear()); }},
      {"battery_v", SetBattery, [](const A& a) { return NumberText(a.encoder.battery_volts()); }},
      {"counting_error", SetCountingError,
       [](const A& a) {
         return std::string(kCountingErrors.at(static_cast<std::size_t>(a.encoder.counting_error())));
       }},
      {"multi_turn_jump", SetJump, [](const A& a) { return std::to_string(a.encoder.turns_jumped()); }},
      {"accel_rad_s2", [](A& a, Text v) { return a.encoder.ShaftToTurn(a.encoder.now()).SetAcceleration(v); },
       [](const A& a) { return NumberText(a.encoder.shaft().acceleration_rad_s2()); }},
      {"motion", [](A& a, Text v) { return a.encoder.ShaftToTurn(a.encoder.now()).SetMotion(v, a.encoder.now()); },
       [](const A& a) { return a.encoder.shaft().motion(); }},
      {"speed_rpm",
       [](A& a, Text v) { return a.encoder.ShaftToTurn(a.encoder.now()).SetSpeed(v, a.encoder.now()); },
       [](const A& a) { return NumberText(a.encoder.shaft().At(a.encoder.now()).speed_rpm); }},
      {"fault", SetFault, [](const A& a) { return FaultText(a.fault); }},
      {"power", SetPower, [](const A& a) { return std::string(a.encoder.powered() ? "on" : "off"); }},
  };
  return kTable;
}

QuantityList SimulatedAxis::Quantities() const {
  QuantityList list = ShownQuantities();
  EncoderModel copy = encoder;  // a look must not draw from its random numbers
  const EncoderModel::Reading reading = copy.Read(copy.now());
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(encoder.shaft().At(encoder.now()).angle)));
  count("single_turn", reading.single_turn);
  count("multi_turn", reading.multi_turn);
  list.emplace_back("alarms", AlarmText(reading));
  count("zeroings", encoder.effects().zeroings);
  count("refused_zeroings", encoder.effects().refused_zeroings);
  count("turn_resets", encoder.effects().turn_resets);
  count("error_clears", encoder.effects().error_clears);
  count("resets_counted", encoder.reset_counter().count());
  count("resets_broken", encoder.reset_counter().broken());
  count("resets_too_early", encoder.reset_counter().too_early());
  count("eeprom_writes", encoder.eeprom().writes_done());
  count("eeprom_writes_lost", encoder.eeprom().writes_lost());
  return list;
}

// ---- the line ----

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

// ---- events ----

// ---- requests ----

// ---- replies ----

// One encoder on its point-to-point line: takes requests apart as strictly as the maker's tables require, answers in
// the wire's time (3 us after the request, 4 us a byte at 2.5 Mbit/s) and complains when it is addressed while it
// transmits. The instants given to it must not run backwards.
class TFormatSimulator final : public UnitSimulator<ScriptedDevice<SimulatedAxis>> {
 public:
  struct Line {
    bool echo = false;                    // the adapter receives its own transmission
    MonoNs byte_time = 4 * kMicrosecond;  // 10 bits at 2.5 Mbit/s, spec 6.1
    std::uint64_t seed = 1;               // of the faults
    std::int64_t baud = 0;                // of the encoder; 0: whatever the host's is
  };

  TFormatSimulator(std::string device, const SimulatedAxis& axis, Script script, const Line& line)
      : UnitSimulator({{std::move(device), axis, std::move(script)}}), line_(line), random_(line.seed) {}

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override {
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
  void OnBaud(std::int64_t baud) override { baud_fits_ = line_.baud == 0 || baud == line_.baud; }
  [[nodiscard]] MonoNs NextDue() const override {
    return std::min({UnitSimulator::NextDue(), frame_ends_, next_pending_});
  }
  void OnDue(MonoNs now, const Transmit& transmit) override {
    CatchUp(now);
    SendDue(now, transmit);
    FinishFrame(now, transmit);
  }

  // Traffic since the start.
  struct Counters {
    std::int64_t requests = 0;    // well-formed
    std::int64_t replies = 0;     // handed to the line, damaged or not
    std::int64_t abnormal = 0;    // answered with data ID 3's data
    std::int64_t bad_sync = 0;    // bytes that began no frame
    std::int64_t unanswered = 0;  // off, in standby, or by a fault
    std::int64_t collisions = 0;  // addressed while it transmits: a real interface circuit may be destroyed
    std::int64_t noise = 0;       // bytes at another baud rate
    std::int64_t writes = 0;      // requests that change something in the encoder, resets and the EEPROM
  };

 private:
  static constexpr std::size_t kLongestRequest = 4;
  static constexpr std::size_t kLongestReply = 11;
  static constexpr std::size_t kMaxPending = 32;
  using ReplyBytes = InlineBytes<kLongestReply>;
  struct Pending {
    MonoNs due = kNever;            // the host gets it
    MonoNs on_wire_until = kNever;  // the encoder has sent it
    ReplyBytes bytes;
  };

  using Unit = ScriptedDevice<SimulatedAxis>;
  [[nodiscard]] CounterList CountersOf(const Unit&) const override {
    return {{"requests", counters_.requests},
            {"replies", counters_.replies},
            {"abnormal_requests", counters_.abnormal},
            {"bad_sync", counters_.bad_sync},
            {"unanswered", counters_.unanswered},
            {"collisions", counters_.collisions},
            {"noise", counters_.noise},
            {"writes", counters_.writes}};
  }
  [[nodiscard]] SimulatedAxis& axis() { return units().front().device; }
  [[nodiscard]] const SimulatedAxis& axis() const { return units().front().device; }
  [[nodiscard]] bool Listens(MonoNs now) const {
    return axis().encoder.Accepts(now) && axis().fault.kind != Kind::kOff;
  }
  void FinishFrame(MonoNs now, const Transmit& transmit) {
    if (now < frame_ends_) return;
    if (Listens(now)) {
      Answer(CheckRequest(frame_, true), now, transmit);
    } else {
      frame_.Clear();
      frame_ends_ = kNever;
    }
  }
  void Take(Bytes bytes, bool delimiter_error, MonoNs now, const Transmit& transmit) {
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
  void Answer(const SimulatedRequest& received, MonoNs now, const Transmit& transmit) {
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
  void Deliver(ReplyBytes reply, MonoNs request_end, MonoNs now, const Transmit& transmit) {
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
  void Collide(MonoNs now) {
    ++counters_.collisions;
    frame_.Clear();
    frame_ends_ = kNever;
    delimiter_error_ = false;
    // Two drivers on one line: what is still being sent is lost.
    for (Pending& pending : pending_) {
      if (pending.due != kNever && now < pending.on_wire_until) pending.due = kNever;
    }
  }
  void SendDue(MonoNs now, const Transmit& transmit) {
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
  void Send(const ReplyBytes& reply, const Transmit& transmit) {
    ++counters_.replies;
    if (!reply.empty()) transmit(reply);
  }

  [[nodiscard]] ReplyBytes Execute(const SimulatedRequest& request, MonoNs at) {
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
  // Spec 6.3.3, Table 2.
  [[nodiscard]] ReplyBytes PositionReply(std::uint8_t field, std::uint8_t data_id, std::uint8_t alarm_bits,
                                         MonoNs at) {
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
  [[nodiscard]] ReplyBytes EepromReply(const SimulatedRequest& request, MonoNs at) {
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

  Line line_;
  SeededRandom random_;
  Counters counters_;

  bool baud_fits_ = true;
  InlineBytes<kLongestRequest> frame_;  // of a request that has begun
  MonoNs frame_ends_ = kNever;          // no further byte until then: the request ends as it is
  bool delimiter_error_ = false;        // in that request
  MonoNs transmitting_until_ = INT64_MIN;
  std::array<Pending, kMaxPending> pending_;
  MonoNs next_pending_ = kNever;
  LateAdapter adapter_;
};

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
