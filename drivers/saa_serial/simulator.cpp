#include "drivers/saa_serial/simulator.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/config/config_map.h"
#include "drivers/saa_serial/settings.h"

namespace axlecast::saa_serial {
namespace {

using Kind = SimulatedFault::Kind;

constexpr MonoNs kShortestLow = 10 * kMicrosecond;  // 5.1.3: T2
// The maximum number of frames that a sleeping host receives late; older frames are lost.
constexpr int kMaxLate = 64;

}  // namespace

// ---- events ----

void SaaSimulator::CatchUp(MonoNs now) {
  if (!units().front().started && setup_.mode == Mode::kTiming) next_frame_ = now;
  UnitSimulator::CatchUp(now);
}

MonoNs SaaSimulator::NextDue() const {
  const MonoNs sent = pending_.empty() ? kNever : pending_.front().due;
  return std::min({UnitSimulator::NextDue(), next_frame_, sent});
}

void SaaSimulator::OnDue(MonoNs now, const Transmit& transmit) {
  CatchUp(now);
  Stream(now);
  SendDue(now, transmit);
}

void SaaSimulator::OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) {
  OnDue(now, transmit);
  if (setup_.echo || units().front().device.fault().kind == Kind::kEcho) transmit(bytes);
  if (!baud_fits_) {
    counters_.noise += static_cast<std::int64_t>(bytes.size());
    return;
  }
  std::vector<std::uint8_t> heard(bytes.begin(), bytes.end());
  for (SaaUnit& unit : units()) {
    const SimulatedFault& fault = unit.device.fault();
    if (fault.kind == Kind::kRequestFlip) FlipBits(heard, 8, fault.amount, unit.device.random());
  }
  const bool paced = !units().front().device.unpaced();
  MonoNs end = now;
  for (const std::uint8_t byte : heard) {
    if (paced) end += setup_.character;
    TakeByte(byte, end);
  }
  SendDue(now, transmit);
}

void SaaSimulator::OnPulse(std::uint8_t line, MonoNs low, MonoNs now, const Transmit& transmit) {
  OnDue(now, transmit);
  SaaUnit& unit = units().front();
  if (line != setup_.clk && line != setup_.clr) return;
  if (low < kShortestLow) {
    ++counters_.short_pulses;
  } else if (!unit.device.powered()) {
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

// ---- the modes ----

MonoNs SaaSimulator::RefreshPeriod() const {
  const double hz = units().front().device.refresh_hz();
  return hz > 0 ? std::llround(1e9 / hz) : setup_.refresh;
}

void SaaSimulator::Stream(MonoNs now) {
  if (next_frame_ > now) return;
  const MonoNs period = RefreshPeriod();
  const MonoNs late = (now - next_frame_) / period;
  if (late > kMaxLate) next_frame_ += (late - kMaxLate) * period;
  for (; next_frame_ <= now; next_frame_ += period) {
    if (units().front().device.powered()) Answer(units().front(), next_frame_, next_frame_);
  }
}

// A command is BC AA and one byte (5.1.5 (1)); what does not fit is dropped byte by byte.
void SaaSimulator::TakeByte(std::uint8_t byte, MonoNs now) {
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

void SaaSimulator::Execute(std::uint8_t command, MonoNs at) {
  bool meant = false;
  for (SaaUnit& unit : units()) {
    const bool asked = command == unit.control;
    const bool zeroed = static_cast<int>(command) == unit.zero;
    if (!asked && !zeroed) continue;
    meant = true;
    if (!unit.device.powered() || unit.device.fault().kind == Kind::kOff) {
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

// ---- frames ----

std::vector<std::uint8_t> SaaSimulator::FrameOf(SaaUnit& unit, MonoNs at) {
  const std::uint32_t counts = unit.device.Sample(at);
  const int bits = unit.device.bits();
  std::vector<std::uint8_t> frame = {0xFF, 0x81};
  if (setup_.mode == Mode::kBus && unit.device.sends_address()) frame[1] = unit.control;
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

void SaaSimulator::Answer(SaaUnit& unit, MonoNs at, MonoNs now) {
  SimulatedEncoder& encoder = unit.device;
  const SimulatedFault& fault = encoder.fault();
  const bool lost = fault.kind == Kind::kIntermittent && encoder.random().Share() < fault.amount;
  if (lost || fault.kind == Kind::kOff) {
    ++counters_.unanswered;
    return;
  }
  std::vector<std::uint8_t> frame = FrameOf(unit, at);
  MonoNs sent = now;
  if (!encoder.unpaced()) sent = at + encoder.processing() + setup_.character * static_cast<MonoNs>(frame.size());
  busy_until_ = sent;
  frame.resize(Damage(std::span(frame), fault, encoder.random()));
  const MonoNs due = adapter_.Due(sent, fault, encoder.random());
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

void SaaSimulator::SendDue(MonoNs now, const Transmit& transmit) {
  while (!pending_.empty() && pending_.front().due <= now) {
    ++counters_.frames;
    std::vector<std::uint8_t> bytes = std::move(pending_.front().bytes);
    pending_.erase(pending_.begin());
    SeededRandom& random = units().front().device.random();
    if (!baud_fits_) std::ranges::generate(bytes, [&random] { return static_cast<std::uint8_t>(random.Next()); });
    if (!bytes.empty()) transmit(bytes);
  }
}

SaaSimulator::CounterList SaaSimulator::CountersOf(const SaaUnit&) const {
  return {{"requests", counters_.requests},       {"frames", counters_.frames},
          {"unanswered", counters_.unanswered},   {"unknown", counters_.unknown},
          {"collisions", counters_.collisions},   {"short_pulses", counters_.short_pulses},
          {"fast_pulses", counters_.fast_pulses}, {"noise", counters_.noise}};
}

namespace {

SaaUnit MakeUnit(const DeviceConfig& device, ConfigMap map) {
  const SaaSettings& settings = Own(device);
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  const double start_deg = map.Number("start_deg", 0, 0, 360, "deg");
  const bool zero_clearing = map.Bool("zero_clearing", true);
  const SimulatedEncoder encoder(settings.format.bits, AngleFromDegrees(start_deg), seed);
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
