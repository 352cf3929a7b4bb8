#include "drivers/biss/simulator.h"

#include <algorithm>

#include "core/config/config_map.h"
#include "drivers/biss/settings.h"

namespace axlecast::biss {
namespace {

using Kind = SimulatedFault::Kind;
using Wiring = SimulatedEncoder::Wiring;

constexpr MonoNs kShortestCycle = 100;  // 5.6: TMAS, ns
constexpr MonoNs kShortestHalf = 25;    // TMASh, TMASl, ns
constexpr MonoNs kSlew = 10;            // "Digital driver maximum slew rate: 10 ns"

void PushBits(std::vector<bool>& bits, std::uint64_t value, int count) {
  for (int i = count - 1; i >= 0; --i) bits.push_back((value >> static_cast<unsigned>(i) & 1) != 0);
}

// The remainder of the message, followed by as many zeros as the polynomial has bits, by long division.
std::vector<bool> CheckBits(const BissSimulator::Setup& setup, std::vector<bool> message) {
  const auto width = static_cast<std::size_t>(setup.crc_bits);
  message.insert(message.end(), width, false);
  const auto term = [](std::uint32_t value, std::size_t power) { return (value >> power & 1U) != 0; };
  for (std::size_t i = 0; i < width; ++i) message[i] = message[i] != term(setup.crc_start, width - 1 - i);
  for (std::size_t i = 0; i + width < message.size(); ++i) {
    if (!message[i]) continue;
    for (std::size_t k = 0; k <= width; ++k) message[i + k] = message[i + k] != term(setup.polynomial, width - k);
  }
  std::vector<bool> remainder(message.end() - static_cast<std::ptrdiff_t>(width), message.end());
  if (setup.crc_inverted) remainder.flip();
  return remainder;
}

}  // namespace

BissSimulator::BissSimulator(const Setup& setup, std::string name, const SimulatedEncoder& encoder, Script script)
    : UnitSimulator({{std::move(name), encoder, std::move(script)}}), setup_(setup) {
  line_.push_back({INT64_MIN, true});
}

// ---- events ----

void BissSimulator::OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) {
  CatchUp(now);
  ++counters_.transfers;
  std::fill(rx.begin(), rx.end(), std::uint8_t{0xFF});  // nobody pulls the line low
  const bool lost =
      encoder().fault().kind == Kind::kIntermittent && encoder().random().Share() < encoder().fault().amount;
  if (!Usable(transfer)) return;
  if (!encoder().powered() || encoder().fault().kind == Kind::kOff || lost) {
    ++counters_.unanswered;
    phase_ = Phase::kIdle;
    line_ = {{INT64_MIN, true}};
  } else {
    Clock(transfer, now, rx);
  }
  Disturb(rx);
}

bool BissSimulator::Usable(const SpiTransfer& transfer) {
  const std::int64_t clock = transfer.settings.clock_hz;
  const bool idles_high = (transfer.settings.mode & 2) != 0;
  const bool bytes = transfer.bits_per_word == 8;
  const bool slow_enough = clock > 0 && kSecond > kShortestCycle * clock && kSecond > 2 * kShortestHalf * clock;
  counters_.wrong_mode += idles_high ? 0 : 1;
  counters_.wrong_words += bytes ? 0 : 1;
  counters_.fast_clock += slow_enough ? 0 : 1;
  return idles_high && bytes && slow_enough;
}

// ---- the lines ----

void BissSimulator::Clock(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) {
  const SpiSettings& spi = transfer.settings;
  const bool on_rising = (spi.mode & 1) != 0;
  if (phase_ != Phase::kIdle && !TimedOut(now)) ++counters_.early;
  for (std::size_t i = 0; i < rx.size() * 8; ++i) {
    const auto clock = static_cast<std::int64_t>(i);
    const MonoNs cycle = now + spi.ClockTime(clock) + clock / 8 * encoder().byte_gap();
    const MonoNs rising = cycle + spi.ClockTime(1) / 2;
    if (TimedOut(cycle)) {
      if (i > 0 && phase_ != Phase::kOver) ++counters_.slow_clock;
      EndFrame();
    }
    bool level = !on_rising && LevelAt(cycle);
    OnRisingEdge(rising);
    if (on_rising) level = LevelAt(rising);
    const auto bit = static_cast<std::uint8_t>(0x80U >> i % 8);
    rx[i / 8] = static_cast<std::uint8_t>(level ? rx[i / 8] | bit : rx[i / 8] & ~bit);
  }
  if (phase_ != Phase::kIdle && phase_ != Phase::kOver) ++counters_.cut;
}

// The clock has rested: the frame is over and the line goes high again (5.6: "Timeout").
bool BissSimulator::TimedOut(MonoNs at) const {
  return phase_ != Phase::kIdle && at >= last_edge_ + encoder().timeout();
}

void BissSimulator::EndFrame() {
  Put(true, last_edge_ + encoder().timeout());
  phase_ = Phase::kIdle;
}

void BissSimulator::OnRisingEdge(MonoNs at) {
  last_edge_ = at;
  switch (phase_) {
    case Phase::kIdle:  // "the first rising edge of MA+ latches the sensor status"
      latched_ = at;
      MakeFrame(at);
      phase_ = Phase::kLatched;
      break;
    case Phase::kLatched:  // "the second rising edge makes the encoder pull SLO+ low"
      Put(false, at);
      acknowledged_ = 0;
      phase_ = Phase::kBusy;
      break;
    case Phase::kBusy:  // "when SLO+ start bit St2 is high, data is ready"
      ++acknowledged_;
      if (acknowledged_ < encoder().busy_clocks() || at - latched_ < encoder().busy()) break;
      Put(true, at);
      phase_ = Phase::kSending;
      break;
    case Phase::kSending:
      Send(at);
      break;
    case Phase::kOver:
      Put(false, at);
      break;
  }
}

void BissSimulator::Send(MonoNs at) {
  Put(frame_[sent_++], at);
  if (sent_ < frame_.size()) return;
  ++counters_.frames;
  phase_ = Phase::kOver;
}

// "a fixed logic 0 bit", then "position data, error bit, warning bit, and 6-bit negative-logic CRC"; "CRC covers
// position data, error bit and warning bit". Turns precede the position, as BiSS defines it.
void BissSimulator::MakeFrame(MonoNs latched) {
  const SimulatedEncoder::Latched value = encoder().Latch(latched);
  std::vector<bool> covered;
  PushBits(covered, value.turns, encoder().turn_bits());
  PushBits(covered, value.position, encoder().bits());
  covered.push_back(!encoder().error());
  covered.push_back(!encoder().warning());
  const std::vector<bool> check = CheckBits(setup_, covered);
  frame_.assign(1, encoder().cds());
  frame_.insert(frame_.end(), covered.begin(), covered.end());
  frame_.insert(frame_.end(), check.begin(), check.end());
  sent_ = 0;
}

void BissSimulator::Put(bool level, MonoNs at) {
  if (line_.back().level != level) line_.push_back({at + encoder().line_delay(), level});
}

bool BissSimulator::LevelAt(MonoNs at) {
  while (line_.size() > 1 && line_[1].at + kSlew <= at) line_.pop_front();
  const bool settled = line_.size() == 1 || line_[1].at - kSlew >= at;
  if (settled) return line_.front().level;
  ++counters_.near_edges;
  return encoder().random().Share() < 0.5;
}

// What the wiring and a fault make of it.
void BissSimulator::Disturb(std::span<std::uint8_t> rx) {
  const SimulatedFault& fault = encoder().fault();
  const std::size_t left = fault.kind == Kind::kOff ? rx.size() : Damage(rx, fault, encoder().random());
  // A frame that ends early: nobody pulls the line low any more.
  std::fill(rx.begin() + static_cast<std::ptrdiff_t>(left), rx.end(), std::uint8_t{0xFF});
  for (std::uint8_t& byte : rx) {
    if (encoder().wiring() == Wiring::kOpen) byte = 0xFF;
    if (encoder().wiring() == Wiring::kShorted) byte = 0x00;
    if (encoder().wiring() == Wiring::kSwapped) byte = static_cast<std::uint8_t>(~byte);
  }
}

BissSimulator::CounterList BissSimulator::CountersOf(const Unit&) const {
  return {{"transfers", counters_.transfers},
          {"frames", counters_.frames},
          {"unanswered", counters_.unanswered},
          {"wrong_mode", counters_.wrong_mode},
          {"wrong_words", counters_.wrong_words},
          {"fast_clock", counters_.fast_clock},
          {"slow_clock", counters_.slow_clock},
          {"early", counters_.early},
          {"cut", counters_.cut},
          {"near_edges", counters_.near_edges}};
}

std::unique_ptr<Simulator> MakeBissSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const DeviceConfig& device = bus.devices.front();
  const Format& format = Own(device).format;
  const std::size_t errors = simulate.errors().list().size();
  ConfigMap map = simulate.Named(device.name);
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  const double start_deg = map.Number("start_deg", 0, 0, 360, "deg");
  const std::int64_t max_turns = (std::int64_t{1} << static_cast<unsigned>(format.turn_bits)) - 1;
  std::int64_t start_turns = 0;
  if (format.turn_bits > 0) start_turns = map.Integer("start_turns", 0, 0, max_turns, "turns");
  const SimulatedEncoder encoder(format.bits, format.turn_bits,
                                 AngleFromDegrees(start_deg) + start_turns * kShaftTurn, seed);
  Script script = ReadScriptOf(map, encoder);
  if (simulate.errors().list().size() != errors) return nullptr;
  const BissSimulator::Setup setup{.polynomial = format.crc.polynomial,
                                   .crc_bits = format.crc.bits,
                                   .crc_start = format.crc.start,
                                   .crc_inverted = format.crc.inverted};
  return std::make_unique<BissSimulator>(setup, device.name, encoder, std::move(script));
}

}  // namespace axlecast::biss
