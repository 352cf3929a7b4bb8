#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/config/config_map.h"
#include "drivers/kit/simulation/shaft_encoder.h"
#include "drivers/saa_serial/family.h"
#include "drivers/saa_serial/settings.h"

namespace axlecast::saa_serial {
namespace {

using Kind = SimulatedFault::Kind;

constexpr MonoNs kShortestLow = 10 * kMicrosecond;  // 5.1.3: T2
// The maximum number of frames that a sleeping host receives late; older frames are lost.
constexpr int kMaxLate = 64;

// One encoder of the SAA series as the maker describes it, and the state of its line, with all that a file, a script or
// an operator can set. Single-turn, binary; counts rise counter-clockwise, which is our reading: the manual does not
// state it.
struct SimulatedEncoder final : ShaftEncoder<SimulatedEncoder> {
  SimulatedEncoder(int resolution_bits, const ShaftStart& start) : ShaftEncoder(start), bits(resolution_bits) {}

  [[nodiscard]] static const QuantityTable<SimulatedEncoder>& Table() {
    using E = SimulatedEncoder;
    static const QuantityTable<E> kTable = WithCommon({
        ChoiceQuantity<E>("pace", &E::unpaced, {"wire", "unpaced"}),
        ChoiceQuantity<E>("reply_header", &E::sends_address, {"81", "address"}),
        NumberQuantity<E>("processing_us", &E::processing_us, 0, 1e6, "us"),
        NumberQuantity<E>("refresh_hz", &E::refresh_hz, 0, 50'000, "Hz (0: as configured)"),
        WholeQuantity<E>("noise_counts", &E::noise_counts, 0, 1'000, "counts"),
        NumberQuantity<E>("zero_error_deg", &E::zero_error_deg, -10, 10, "deg"),
    });
    return kTable;
  }
  // Every quantity with its present value, then what it would send now and how often it was zeroed.
  [[nodiscard]] QuantityList Quantities() const {
    QuantityList list = ShownQuantities();
    const ShaftAngle angle = shaft.At(now).angle;
    list.emplace_back("angle_deg", NumberText(DegreesFromAngle(angle)));
    list.emplace_back("single_turn", std::to_string(CountsFromAngle(angle - zero, bits)));
    list.emplace_back("zeroings", std::to_string(zeroings));
    return list;
  }

  // The counts that it samples at `at`, which may be a little later than the last Advance.
  [[nodiscard]] std::uint32_t Sample(MonoNs at) {
    const auto counts = static_cast<std::uint32_t>(CountsFromAngle(Measured(at) - zero, bits));
    const auto noise = static_cast<std::int64_t>(noise_counts);
    const auto shift = static_cast<std::uint32_t>(noise == 0 ? 0 : random.Around(noise));
    return (counts + shift) & ((1U << static_cast<unsigned>(bits)) - 1);
  }
  // The position at `at` becomes zero.
  void ClearToZero(MonoNs at) {
    zero = shaft.At(at).angle - AngleFromDegrees(zero_error_deg);
    ++zeroings;
  }
  // T3: from the request or the refresh instant to the first bit.
  [[nodiscard]] MonoNs processing() const { return std::llround((processing_us + slow_us()) * 1e3); }

  int bits;
  ShaftAngle zero = 0;
  bool unpaced = false;
  bool sends_address = false;  // in the second byte, instead of 81H
  double processing_us = 20;
  double refresh_hz = 0;  // 0: as configured
  double noise_counts = 0;
  double zero_error_deg = 0;
  std::int64_t zeroings = 0;
};

// One encoder on the line.
struct SaaUnit : ScriptedDevice<SimulatedEncoder> {
  std::uint8_t control = 0;  // BX
  int zero = -1;             // CX; -1: a variant without zero clearing
};

// ---- events ----

// ---- the modes ----

// ---- frames ----

// The encoders on one line, in one of the maker's modes (SAA manual 5.1.1 to 5.1.6), written from the manual alone.
// It drops what a real encoder would drop: CLK pulses that are too short, or that come while it still works on the
// one before; commands of no encoder; all that is sent while an encoder transmits. The instants given to it must not
// run backwards.
class SaaSimulator final : public UnitSimulator<SaaUnit> {
 public:
  enum class Mode : std::uint8_t { kTiming, kHandshake, kBus };

  struct Setup {
    Mode mode = Mode::kBus;
    int clk = -1;                     // index of the CLK line; -1: none
    int clr = -1;                     // of the CLR line
    MonoNs refresh = kMillisecond;    // timing: T3 of 5.1.1
    MonoNs character = kMillisecond;  // on the wire
    bool echo = false;                // the adapter receives its own transmission
    std::int64_t baud = 0;            // of the encoders; 0: whatever the host's is
  };

  SaaSimulator(const Setup& setup, std::vector<SaaUnit> units) : UnitSimulator(std::move(units)), setup_(setup) {}

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override {
    OnDue(now, transmit);
    if (setup_.echo || units().front().device.fault.kind == Kind::kEcho) transmit(bytes);
    if (!baud_fits_) {
      counters_.noise += static_cast<std::int64_t>(bytes.size());
      return;
    }
    std::vector<std::uint8_t> heard(bytes.begin(), bytes.end());
    for (SaaUnit& unit : units()) {
      const SimulatedFault& fault = unit.device.fault;
      if (fault.kind == Kind::kRequestFlip) FlipBits(heard, 8, fault.amount, unit.device.random);
    }
    const bool paced = !units().front().device.unpaced;
    MonoNs end = now;
    for (const std::uint8_t byte : heard) {
      if (paced) end += setup_.character;
      TakeByte(byte, end);
    }
    SendDue(now, transmit);
  }
  void OnBaud(std::int64_t baud) override { baud_fits_ = setup_.baud == 0 || baud == setup_.baud; }
  void OnPulse(std::uint8_t line, MonoNs low, MonoNs now, const Transmit& transmit) override {
    OnDue(now, transmit);
    SaaUnit& unit = units().front();
    if (line != setup_.clk && line != setup_.clr) return;
    if (low < kShortestLow) {
      ++counters_.short_pulses;
    } else if (!unit.device.powered) {
      ++counters_.unanswered;
    } else if (line == setup_.clr) {
      unit.device.ClearToZero(now - low);  // at the falling edge
    } else if (now - low < busy_until_) {
      ++counters_.fast_pulses;
    } else {
      ++counters_.requests;
      Answer(unit, now - low, now);
    }
    SendDue(now, transmit);
  }
  [[nodiscard]] MonoNs NextDue() const override {
    const MonoNs sent = pending_.empty() ? kNever : pending_.front().due;
    return std::min({UnitSimulator::NextDue(), next_frame_, sent});
  }
  void OnDue(MonoNs now, const Transmit& transmit) override {
    CatchUp(now);
    Stream(now);
    SendDue(now, transmit);
  }

  // Traffic since the start.
  struct Counters {
    std::int64_t requests = 0;      // control commands and CLK pulses that were taken
    std::int64_t frames = 0;        // handed to the line, damaged or not
    std::int64_t unanswered = 0;    // off, without power, or by a fault
    std::int64_t unknown = 0;       // bytes and commands that mean nothing to any encoder
    std::int64_t collisions = 0;    // bytes sent while an encoder transmits
    std::int64_t short_pulses = 0;  // on CLK or CLR, below 10 us
    std::int64_t fast_pulses = 0;   // on CLK, while the encoder still works on the last one
    std::int64_t noise = 0;         // bytes at another baud rate
  };

 private:
  struct Pending {
    MonoNs due = 0;            // the host gets it
    MonoNs on_wire_until = 0;  // the encoder has sent it
    std::vector<std::uint8_t> bytes;
  };

  void CatchUp(MonoNs now) override {
    if (!units().front().started && setup_.mode == Mode::kTiming) next_frame_ = now;
    UnitSimulator::CatchUp(now);
  }
  [[nodiscard]] CounterList CountersOf(const SaaUnit&) const override {
    return {{"requests", counters_.requests},       {"frames", counters_.frames},
            {"unanswered", counters_.unanswered},   {"unknown", counters_.unknown},
            {"collisions", counters_.collisions},   {"short_pulses", counters_.short_pulses},
            {"fast_pulses", counters_.fast_pulses}, {"noise", counters_.noise}};
  }
  void Stream(MonoNs now) {
    if (next_frame_ > now) return;
    const MonoNs period = RefreshPeriod();
    const MonoNs late = (now - next_frame_) / period;
    if (late > kMaxLate) next_frame_ += (late - kMaxLate) * period;
    for (; next_frame_ <= now; next_frame_ += period) {
      if (units().front().device.powered) Answer(units().front(), next_frame_, next_frame_);
    }
  }
  // A command is BC AA and one byte (5.1.5 (1)); what does not fit is dropped byte by byte.
  void TakeByte(std::uint8_t byte, MonoNs now) {
    if (now <= busy_until_) {
      // Two drivers on one line: what is being sent is lost too.
      ++counters_.collisions;
      request_.clear();
      std::erase_if(pending_, [now](const Pending& pending) { return now <= pending.on_wire_until; });
      return;
    }
    request_.push_back(byte);
    if (setup_.mode != Mode::kBus || request_.front() != 0xBC || (request_.size() == 2 && byte != 0xAA)) {
      ++counters_.unknown;
      request_.clear();
      if (setup_.mode == Mode::kBus && byte == 0xBC) request_.push_back(byte);
    } else if (request_.size() == 3) {
      request_.clear();
      Execute(byte, now);
    }
  }
  void Execute(std::uint8_t command, MonoNs at) {
    bool meant = false;
    for (SaaUnit& unit : units()) {
      const bool asked = command == unit.control;
      const bool zeroed = static_cast<int>(command) == unit.zero;
      if (!asked && !zeroed) continue;
      meant = true;
      if (!unit.device.powered || unit.device.fault.kind == Kind::kOff) {
        ++counters_.unanswered;
      } else if (zeroed) {
        unit.device.ClearToZero(at);  // nothing answers it (5.1.6 (1))
      } else {
        ++counters_.requests;
        Answer(unit, at, at);
      }
    }
    if (!meant) ++counters_.unknown;
  }
  // The frame of a position sampled at `at`, sent from then on.
  void Answer(SaaUnit& unit, MonoNs at, MonoNs now) {
    SimulatedEncoder& encoder = unit.device;
    const SimulatedFault& fault = encoder.fault;
    const bool lost = fault.kind == Kind::kIntermittent && encoder.random.Share() < fault.amount;
    if (lost || fault.kind == Kind::kOff) {
      ++counters_.unanswered;
      return;
    }
    std::vector<std::uint8_t> frame = FrameOf(unit, at);
    MonoNs sent = now;
    if (!encoder.unpaced) sent = at + encoder.processing() + setup_.character * static_cast<MonoNs>(frame.size());
    busy_until_ = sent;
    frame.resize(Damage(std::span(frame), fault, encoder.random));
    const MonoNs due = adapter_.Due(sent, fault, encoder.random);
    // The adapter hands everything over in the order in which the line carried it.
    const MonoNs before = pending_.empty() ? 0 : pending_.back().due;
    if (fault.kind != Kind::kScattered) {
      pending_.push_back({std::max(due, before), sent, std::move(frame)});
      return;
    }
    const auto behind =
        std::find_if(pending_.begin(), pending_.end(), [due](const Pending& p) { return p.due > due; });
    pending_.insert(behind, {due, sent, std::move(frame)});
  }
  [[nodiscard]] std::vector<std::uint8_t> FrameOf(SaaUnit& unit, MonoNs at) {
    const std::uint32_t counts = unit.device.Sample(at);
    const int bits = unit.device.bits;
    std::vector<std::uint8_t> frame = {0xFF, 0x81};
    if (setup_.mode == Mode::kBus && unit.device.sends_address) frame[1] = unit.control;
    // Tables (2): "≤16bit", "17~24bit", ">24bit", the top eight bits first.
    if (bits > 24) frame.push_back(static_cast<std::uint8_t>(counts >> 24U));
    if (bits > 16) frame.push_back(static_cast<std::uint8_t>(counts >> 16U));
    frame.push_back(static_cast<std::uint8_t>(counts >> 8U));
    frame.push_back(static_cast<std::uint8_t>(counts));
    std::uint8_t sum = 0;
    for (const std::uint8_t byte : frame) sum = static_cast<std::uint8_t>(sum + byte);
    frame.push_back(sum);
    return frame;
  }
  void SendDue(MonoNs now, const Transmit& transmit) {
    while (!pending_.empty() && pending_.front().due <= now) {
      ++counters_.frames;
      std::vector<std::uint8_t> bytes = std::move(pending_.front().bytes);
      pending_.erase(pending_.begin());
      SeededRandom& random = units().front().device.random;
      if (!baud_fits_) std::ranges::generate(bytes, [&random] { return static_cast<std::uint8_t>(random.Next()); });
      if (!bytes.empty()) transmit(bytes);
    }
  }
  [[nodiscard]] MonoNs RefreshPeriod() const {
    const double hz = units().front().device.refresh_hz;
    return hz > 0 ? std::llround(1e9 / hz) : setup_.refresh;
  }

  Setup setup_;
  Counters counters_;
  bool baud_fits_ = true;
  std::vector<std::uint8_t> request_;
  MonoNs next_frame_ = kNever;  // timing
  MonoNs busy_until_ = INT64_MIN;
  std::vector<Pending> pending_;
  LateAdapter adapter_;
};

SaaUnit MakeUnit(const DeviceConfig& device, ConfigMap map) {
  const SaaSettings& settings = Own(device);
  const bool zero_clearing = map.Bool("zero_clearing", true);
  const SimulatedEncoder encoder(settings.format.bits, ReadShaftStart(map));
  SaaUnit unit{{device.name, encoder, ReadScriptOf(map, encoder)}, settings.format.address};
  if (settings.zero_command && zero_clearing) unit.zero = *settings.zero_command;
  return unit;
}

}  // namespace

std::unique_ptr<Simulator> MakeSaaSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const std::size_t errors = simulate.errors().list().size();
  const SaaBus& own = OwnBus(bus);
  SaaSimulator::Setup setup;
  setup.mode = static_cast<SaaSimulator::Mode>(own.mode);
  if (own.clk) setup.clk = own.clk->index;
  if (own.clr) setup.clr = own.clr->index;
  setup.refresh = own.refresh;
  setup.baud = bus.link.line.baud;
  setup.character = bus.link.line.WireTime(1);
  setup.echo = bus.link.echo;
  std::vector<SaaUnit> units;
  for (const DeviceConfig& device : bus.devices) units.push_back(MakeUnit(device, simulate.Named(device.name)));
  if (simulate.errors().list().size() != errors) return nullptr;
  return std::make_unique<SaaSimulator>(setup, std::move(units));
}

}  // namespace axlecast::saa_serial
