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
// Frames that a sleeping host is served late; older ones nobody hears any more.
constexpr int kMaxLate = 64;

}  // namespace

SaaSimulator::SaaSimulator(const Setup& setup, std::vector<Unit> units) : setup_(setup), units_(std::move(units)) {}

// ---- events ----

void SaaSimulator::CatchUp(MonoNs now) {
  if (!started_) {
    started_ = true;
    for (Unit& unit : units_) unit.script.Start(unit.encoder, now);
    if (setup_.mode == Mode::kTiming) next_frame_ = now;
  }
  for (Unit& unit : units_) {
    unit.script.Run(unit.encoder, now);
    unit.encoder.Advance(now);
  }
}

MonoNs SaaSimulator::NextDue() const {
  if (!started_) return 0;
  MonoNs due = next_frame_;
  for (const Unit& unit : units_) due = std::min(due, unit.script.NextDue());
  if (!pending_.empty()) due = std::min(due, pending_.front().due);
  return due;
}

void SaaSimulator::OnDue(MonoNs now, const Transmit& transmit) {
  CatchUp(now);
  Stream(now);
  SendDue(now, transmit);
}

void SaaSimulator::OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) {
  OnDue(now, transmit);
  if (setup_.echo || units_.front().encoder.fault().kind == Kind::kEcho) transmit(bytes);
  if (!baud_fits_) {
    counters_.noise += static_cast<std::int64_t>(bytes.size());
    return;
  }
  std::vector<std::uint8_t> heard(bytes.begin(), bytes.end());
  for (Unit& unit : units_) {
    const SimulatedFault& fault = unit.encoder.fault();
    if (fault.kind == Kind::kRequestFlip) FlipBits(heard, 8, fault.amount, unit.encoder.random());
  }
  const bool paced = !units_.front().encoder.unpaced();
  MonoNs end = now;
  for (const std::uint8_t byte : heard) {
    if (paced) end += setup_.character;
    TakeByte(byte, end);
  }
  SendDue(now, transmit);
}

void SaaSimulator::OnPulse(std::uint8_t line, MonoNs low, MonoNs now, const Transmit& transmit) {
  OnDue(now, transmit);
  Unit& unit = units_.front();
  if (line != setup_.clk && line != setup_.clr) return;
  if (low < kShortestLow) {
    ++counters_.short_pulses;
  } else if (!unit.encoder.powered()) {
    ++counters_.unanswered;
  } else if (line == setup_.clr) {
    unit.encoder.ClearToZero(now - low);  // at the falling edge
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
  const double hz = units_.front().encoder.refresh_hz();
  return hz > 0 ? std::llround(1e9 / hz) : setup_.refresh;
}

void SaaSimulator::Stream(MonoNs now) {
  if (next_frame_ > now) return;
  const MonoNs period = RefreshPeriod();
  const MonoNs late = (now - next_frame_) / period;
  if (late > kMaxLate) next_frame_ += (late - kMaxLate) * period;
  for (; next_frame_ <= now; next_frame_ += period) {
    if (units_.front().encoder.powered()) Answer(units_.front(), next_frame_, next_frame_);
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
  for (Unit& unit : units_) {
    const bool asked = command == unit.control;
    const bool zeroed = static_cast<int>(command) == unit.zero;
    if (!asked && !zeroed) continue;
    meant = true;
    if (!unit.encoder.powered() || unit.encoder.fault().kind == Kind::kOff) {
      ++counters_.unanswered;
    } else if (zeroed) {
      unit.encoder.ClearToZero(at);  // nothing answers it (5.1.6 (1))
    } else {
      ++counters_.requests;
      Answer(unit, at, at);
    }
  }
  if (!meant) ++counters_.unknown;
}

// ---- frames ----

std::vector<std::uint8_t> SaaSimulator::FrameOf(Unit& unit, MonoNs at) {
  const std::uint32_t counts = unit.encoder.Sample(at);
  const int bits = unit.encoder.bits();
  std::vector<std::uint8_t> frame = {0xFF, 0x81};
  if (setup_.mode == Mode::kBus && unit.encoder.says_address()) frame[1] = unit.control;
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

void SaaSimulator::Answer(Unit& unit, MonoNs at, MonoNs now) {
  SimulatedEncoder& encoder = unit.encoder;
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
    SeededRandom& random = units_.front().encoder.random();
    if (!baud_fits_) std::ranges::generate(bytes, [&random] { return static_cast<std::uint8_t>(random.Next()); });
    if (!bytes.empty()) transmit(bytes);
  }
}

// ---- whoever looks on ----

SaaSimulator::Unit* SaaSimulator::Find(std::string_view device) {
  const auto found =
      std::find_if(units_.begin(), units_.end(), [&](const Unit& unit) { return unit.name == device; });
  return found == units_.end() ? nullptr : &*found;
}

std::string SaaSimulator::Set(std::string_view device, std::string_view key, std::string_view value, MonoNs now) {
  CatchUp(now);
  Unit* unit = Find(device);
  if (unit == nullptr) return "no simulated device '" + std::string(device) + "' here";
  const std::string problem = unit->encoder.Set(key, value);
  return problem.empty() ? "" : unit->name + '.' + std::string(key) + ": " + problem;
}

std::vector<std::pair<std::string, std::string>> SaaSimulator::State(std::string_view device, MonoNs now) const {
  const auto found =
      std::find_if(units_.begin(), units_.end(), [&](const Unit& unit) { return unit.name == device; });
  if (found == units_.end()) return {};
  SimulatedEncoder encoder = found->encoder;
  encoder.Advance(now);
  std::vector<std::pair<std::string, std::string>> list = encoder.Quantities();
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  count("requests", counters_.requests);
  count("frames", counters_.frames);
  count("unanswered", counters_.unanswered);
  count("unknown", counters_.unknown);
  count("collisions", counters_.collisions);
  count("short_pulses", counters_.short_pulses);
  count("fast_pulses", counters_.fast_pulses);
  count("noise", counters_.noise);
  return list;
}

namespace {

SaaSimulator::Unit MakeUnit(const DeviceConfig& device, ConfigMap map) {
  const SaaSettings& settings = Own(device);
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  const double start_deg = map.Number("start_deg", 0, 0, 360, "deg");
  const bool zero_clearing = map.Bool("zero_clearing", true);
  SaaSimulator::Unit unit{.name = device.name,
                          .encoder = SimulatedEncoder(settings.format.bits, AngleFromDegrees(start_deg), seed),
                          .script = {},
                          .control = settings.format.address,
                          .zero = -1};
  if (settings.zero_command && zero_clearing) unit.zero = *settings.zero_command;
  SimulatedEncoder tried = unit.encoder;
  unit.script = ReadScript(map, SimulatedEncoder::QuantityNames(), tried);
  map.Done();
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
  std::vector<SaaSimulator::Unit> units;
  for (const DeviceConfig& device : bus.devices) units.push_back(MakeUnit(device, simulate.Named(device.name)));
  if (simulate.errors().list().size() != errors) return nullptr;
  return std::make_unique<SaaSimulator>(setup, std::move(units));
}

}  // namespace axlecast::saa_serial
