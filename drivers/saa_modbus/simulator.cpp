#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "core/device/line_settings.h"
#include "drivers/kit/simulation/shaft_encoder.h"
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

// "Definition of Setting" IV to VIII.
constexpr std::array<std::uint8_t, 5> kBaudCodes = {0x24, 0x48, 0x96, 0x19, 0x57};
constexpr std::array<std::int64_t, 5> kBauds = {2'400, 4'800, 9'600, 19'200, 57'600};
constexpr std::array<std::string_view, 5> kBaudWords = {"2400", "4800", "9600", "19200", "57600"};

// Returns 0 for another parameter.
std::int64_t RateOf(std::uint8_t parameter) {
  const auto* found = std::find(kBaudCodes.begin(), kBaudCodes.end(), parameter);
  return found == kBaudCodes.end() ? 0 : kBauds.at(static_cast<std::size_t>(found - kBaudCodes.begin()));
}

// One SAA encoder as the manual describes it (4.1, 5.1.7), without its line, and all that a file, a script or an
// operator can set. Address, baud rate, zero and direction survive a power-off.
struct SimulatedEncoder final : ShaftEncoder<SimulatedEncoder> {
  // What the document does not define.
  enum class TwoPoints : std::uint8_t { kPadded, kIgnored };  // up to 16 bits, a request for two registers
  enum class BaudReply : std::uint8_t { kOld, kNew };         // the rate of the reply to a new rate

  using ShaftEncoder::ShaftEncoder;

  [[nodiscard]] static const QuantityTable<SimulatedEncoder>& Table() {
    using E = SimulatedEncoder;
    static const QuantityTable<E> kTable = WithCommon({
        WholeQuantity<E>("address", &E::address, 1, 247, ""),
        {"baud", SetBaud, [](const E& e) { return std::to_string(e.baud); }},
        ChoiceQuantity<E>("counting", &E::negative, {"positive", "negative"}),
        {"zero_deg", SetZeroAngle, [](const E& e) { return NumberText(DegreesFromAngle(e.zero)); }},
        WholeQuantity<E>("noise_counts", &E::noise_counts, 0, 1'000, "counts"),
        NumberQuantity<E>("reply_us", &E::reply_us, 0, 1e6, "us"),
        ChoiceQuantity<E>("query_crc", &E::query_crc_lsb, {"msb_first", "lsb_first"}),
        ChoiceQuantity<E>("two_points", &E::two_points, {"padded", "ignored"}),
        ChoiceQuantity<E>("baud_reply", &E::baud_reply, {"old", "new"}),
    });
    return kTable;
  }

  // Every quantity with its present value, then what the encoder measures and how often its memory was written.
  [[nodiscard]] QuantityList Quantities() const {
    QuantityList list = ShownQuantities();
    SimulatedEncoder copy = *this;  // a look must not draw from the random numbers
    list.emplace_back("angle_deg", NumberText(DegreesFromAngle(shaft.At(now).angle)));
    list.emplace_back("single_turn", std::to_string(copy.Position()));
    list.emplace_back("writes", std::to_string(writes));
    return list;
  }

  // Returns the position as it would be transmitted now.
  [[nodiscard]] std::uint32_t Position() {
    const ShaftAngle angle = Measured(now) - zero;
    const auto counts = static_cast<std::int64_t>(CountsFromAngle(negative ? -angle : angle, bits));
    const std::int64_t noise = noise_counts > 0 ? random.Around(noise_counts) : 0;
    return static_cast<std::uint32_t>((counts + noise) & ((std::int64_t{1} << bits) - 1));
  }
  void SetZero() { zero = shaft.At(now).angle; }

  int bits = 16;
  std::uint8_t address = 1;
  std::int64_t baud = 19'200;
  bool negative = false;    // the direction: counts fall counter-clockwise
  ShaftAngle zero = 0;      // shaft angle at which it reads 0
  std::int64_t writes = 0;  // of its memory
  std::int64_t noise_counts = 0;
  double reply_us = 500;  // from the end of the silent interval to the reply
  bool query_crc_lsb = false;
  TwoPoints two_points = TwoPoints::kPadded;
  BaudReply baud_reply = BaudReply::kOld;

 private:
  [[nodiscard]] static Result<> SetBaud(SimulatedEncoder& encoder, std::string_view text) {
    const Result<std::size_t> rate = ParseChoice(text, kBaudWords);
    if (!rate) return Failure(rate.error());
    encoder.baud = kBauds.at(*rate);
    return {};
  }
  [[nodiscard]] static Result<> SetZeroAngle(SimulatedEncoder& encoder, std::string_view text) {
    const Result<double> degrees = ParseNumber(text, 0, 360, "deg");
    if (!degrees) return Failure(degrees.error());
    encoder.zero = AngleFromDegrees(*degrees);
    return {};
  }
};

// One encoder on the line, with its traffic since the start.
struct SaaModbusUnit : ScriptedDevice<SimulatedEncoder> {
  struct Counters {
    std::int64_t requests = 0;    // understood and carried out
    std::int64_t replies = 0;     // handed to the line, damaged or not
    std::int64_t ignored = 0;     // addressed to it, but not a request of the manual
    std::int64_t bad_crc = 0;     // frames, for any address
    std::int64_t noise = 0;       // frames at another baud rate
    std::int64_t unanswered = 0;  // by a fault
    std::int64_t collisions = 0;  // replies destroyed because another one transmitted
  };
  Counters counters;
};

// SAA encoders on one Modbus line, as in the manual's 5.1.7. A frame ends with 3.5 characters of silence. Bytes that
// come sooner after other traffic belong to that traffic. A frame is not answered if its CRC is wrong, if it is for
// another address, or if the manual does not define it. An encoder at another baud rate than the host's receives noise,
// and the host receives noise from it. Two encoders that answer at once destroy each other's replies. Time must not run
// backwards.
class SaaModbusSimulator final : public UnitSimulator<SaaModbusUnit> {
 public:
  struct Line {
    LineFormat format{.baud = 19'200};  // of the host, until OnBaud
    bool echo = false;                  // the adapter receives its own transmission
    bool paced = true;                  // frames take their time on the wire and need their pauses
  };

  SaaModbusSimulator(const Line& line, std::vector<SaaModbusUnit> units)
      : UnitSimulator(std::move(units)), line_(line) {}

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override {
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
  void OnBaud(std::int64_t baud) override {
    host_baud_ = baud;
    line_.format.baud = baud;
  }
  [[nodiscard]] MonoNs NextDue() const override {
    MonoNs due = std::min(UnitSimulator::NextDue(), frame_ends_);
    for (const Pending& pending : pending_) due = std::min(due, pending.due);
    return due;
  }
  void OnDue(MonoNs now, const Transmit& transmit) override {
    CatchUp(now);
    SendDue(now, transmit);
    FinishFrame(now, transmit);
  }

 private:
  struct Pending {
    std::size_t unit = 0;
    Interval on_wire;
    MonoNs due = kNever;  // the host gets it
    std::int64_t baud = 0;
    Frame bytes;
    bool destroyed = false;
  };
  struct Answer {
    Frame bytes;
    std::int64_t baud = 0;
  };

  [[nodiscard]] CounterList CountersOf(const SaaModbusUnit& unit) const override {
    const SaaModbusUnit::Counters& own = unit.counters;
    return {{"requests", own.requests},     {"replies", own.replies},   {"ignored", own.ignored},
            {"bad_crc", own.bad_crc},       {"noise", own.noise},       {"unanswered", own.unanswered},
            {"collisions", own.collisions}, {"short_gaps", short_gaps_}};
  }
  [[nodiscard]] MonoNs WireTime(std::size_t characters, std::int64_t baud) const {
    LineFormat format = line_.format;
    format.baud = baud;
    return line_.paced ? format.WireTime(characters) : 0;
  }
  // "The interval time between the beginning and the end of each frame is at least 3.5 bytes."
  [[nodiscard]] MonoNs Gap() const { return WireTime(7, line_.format.baud) / 2; }
  void FinishFrame(MonoNs now, const Transmit& transmit) {
    if (now < frame_ends_) return;
    const MonoNs end = frame_ends_;
    frame_ends_ = kNever;
    for (std::size_t i = 0; i < units().size(); ++i) Receive(i, end, now);
    frame_.Clear();
    frame_bad_ = false;
    SendDue(now, transmit);
  }
  void Receive(std::size_t index, MonoNs end, MonoNs now) {
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
  [[nodiscard]] std::optional<Answer> Execute(SaaModbusUnit& unit, Bytes frame, MonoNs at) {
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
  void Reply(std::size_t index, const Answer& answer, MonoNs request_end) {
    SimulatedEncoder& encoder = units()[index].device;
    std::array<std::uint8_t, kMaxFrame> bytes{};
    std::copy_n(answer.bytes.data(), answer.bytes.size(), bytes.begin());
    const std::span<std::uint8_t> reply(bytes.data(), answer.bytes.size());
    const std::size_t left = Damage(reply, encoder.fault, encoder.random);
    Pending pending;
    pending.unit = index;
    pending.bytes = Frame(Bytes(bytes.data(), left));
    const MonoNs own_time = line_.paced ? std::llround(encoder.reply_us * 1e3) : 0;
    pending.on_wire.first = request_end + own_time + std::llround(encoder.slow_us() * 1e3);
    pending.on_wire.last = pending.on_wire.first + WireTime(answer.bytes.size(), answer.baud);
    pending.due = adapter_.Due(pending.on_wire.last, encoder.fault, encoder.random);
    pending.baud = answer.baud;
    Collide(pending);
    pending_.push_back(pending);
  }
  void Collide(Pending& added) {
    for (Pending& other : pending_) {
      const bool apart =
          line_.paced ? other.on_wire.first >= added.on_wire.last || other.on_wire.last <= added.on_wire.first
                      : other.on_wire.first != added.on_wire.first;
      if (apart) continue;
      for (Pending* both : {&other, &added}) {
        if (!both->destroyed) ++units()[both->unit].counters.collisions;
        both->destroyed = true;
      }
    }
  }
  void SendDue(MonoNs now, const Transmit& transmit) {
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

  Line line_;
  std::optional<std::int64_t> host_baud_;  // the last OnBaud
  Frame frame_;                            // of the host, so far
  bool frame_bad_ = false;                 // it ran into other traffic
  MonoNs frame_ends_ = kNever;             // with its silence
  MonoNs busy_until_ = 0;                  // last character on the wire, of any sender
  std::vector<Pending> pending_;
  LateAdapter adapter_;
  std::int64_t short_gaps_ = 0;
};

// The encoder that the device's own keys describe, as the configuration expects to find it.
SaaModbusUnit MakeUnit(const BusConfig& bus, const DeviceConfig& device, ConfigMap map) {
  const auto& settings = static_cast<const SaaModbusSettings&>(*device.settings);
  const auto bits = static_cast<int>(map.Integer("bits", settings.bits, 10, 26, "bits"));  // SAA manual 4.1
  SimulatedEncoder encoder(ReadShaftStart(map));
  encoder.bits = bits;
  encoder.address = settings.address;
  encoder.baud = bus.link.line.baud;
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
