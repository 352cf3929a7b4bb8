#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/config/config_map.h"
#include "drivers/biss/family.h"
#include "drivers/biss/settings.h"
#include "drivers/kit/simulation/shaft_encoder.h"

namespace axlecast::biss {
namespace {

using Kind = SimulatedFault::Kind;

// One BiSS-C encoder and its line, with all that a file, a script or an operator can set. Binary; counts rise
// counter-clockwise, which is our reading: the manual does not state it.
struct SimulatedEncoder final : ShaftEncoder<SimulatedEncoder> {
  // What is wrong with the line, besides a fault.
  enum class Wiring : std::uint8_t { kGood, kOpen, kShorted, kSwapped };

  SimulatedEncoder(int single_turn_bits, int multi_turn_bits, const ShaftStart& start)
      : ShaftEncoder(start), bits(single_turn_bits), turn_bits(multi_turn_bits) {}

  [[nodiscard]] static const QuantityTable<SimulatedEncoder>& Table() {
    using E = SimulatedEncoder;
    static const QuantityTable<E> kTable = WithCommon(
        {
            NumberQuantity<E>("line_delay_ns", &E::line_delay_ns, 0, 100'000, "ns"),
            NumberQuantity<E>("byte_gap_us", &E::byte_gap_us, 0, 1'000, "us"),
            NumberQuantity<E>("timeout_us", &E::timeout_us, 1, 1'000, "us"),
            NumberQuantity<E>("busy_us", &E::busy_us, 0, 10'000, "us"),
            WholeQuantity<E>("busy_clocks", &E::busy_clocks, 1, 1'000, "clocks"),
            ChoiceQuantity<E>("error", &E::error, {"off", "on"}),
            ChoiceQuantity<E>("warning", &E::warning, {"off", "on"}),
            ChoiceQuantity<E>("cds", &E::cds, {"off", "on"}),
            ChoiceQuantity<E>("wiring", &E::wiring, {"good", "open", "shorted", "swapped"}),
            WholeQuantity<E>("noise_counts", &E::noise_counts, 0, 1'000, "counts"),
        },
        [](const SimulatedFault& fault) -> Result<> {
          constexpr std::array kUnfit = {Kind::kRequestFlip, Kind::kDelayed, Kind::kLate, Kind::kScattered,
                                         Kind::kEcho};
          if (std::find(kUnfit.begin(), kUnfit.end(), fault.kind) == kUnfit.end()) return {};
          return Failure(" has no meaning here: the encoder is asked by its clock, and answers with it");
        });
    return kTable;
  }
  // Every quantity with its present value, then what it would send now.
  [[nodiscard]] QuantityList Quantities() const {
    QuantityList list = ShownQuantities();
    const ShaftAngle angle = shaft.At(now).angle;
    list.emplace_back("angle_deg", NumberText(DegreesFromAngle(angle)));
    list.emplace_back("single_turn", std::to_string(CountsFromAngle(angle, bits)));
    if (turn_bits > 0) list.emplace_back("multi_turn", std::to_string(TurnsFromAngle(angle, turn_bits)));
    return list;
  }

  // The angle that it latches at `at`, which may be a little later than the last Advance.
  [[nodiscard]] ShaftAngle Latch(MonoNs at) {
    const ShaftAngle angle = Measured(at);
    const auto noise = static_cast<std::int64_t>(noise_counts);
    if (noise == 0) return angle;
    const std::int64_t shift = random.Around(noise);
    return angle + (bits <= kTurnBits ? shift * (std::int64_t{1} << static_cast<unsigned>(kTurnBits - bits))
                                      : shift / (std::int64_t{1} << static_cast<unsigned>(bits - kTurnBits)));
  }
  [[nodiscard]] MonoNs line_delay() const { return std::llround(line_delay_ns); }
  [[nodiscard]] MonoNs byte_gap() const { return std::llround(byte_gap_us * 1e3); }
  [[nodiscard]] MonoNs timeout() const { return std::llround(timeout_us * 1e3); }
  // From latching to the start bit, at least.
  [[nodiscard]] MonoNs busy() const { return std::llround((busy_us + slow_us()) * 1e3); }

  int bits;
  int turn_bits;
  Wiring wiring = Wiring::kGood;
  bool error = false;
  bool warning = false;
  bool cds = false;  // the fixed 0 is sent as 1
  double line_delay_ns = 60;
  double byte_gap_us = 0;
  double timeout_us = 16;
  double busy_us = 0;
  double busy_clocks = 2;  // of acknowledgement, at least
  double noise_counts = 0;
};

constexpr MonoNs kShortestCycle = 100;  // 5.6: TMAS, ns
constexpr MonoNs kShortestHalf = 25;    // TMASh, TMASl, ns
constexpr MonoNs kSlew = 10;            // "Digital driver maximum slew rate: 10 ns"

void PushBits(std::vector<bool>& bits, std::uint64_t value, int count) {
  for (int i = count - 1; i >= 0; --i) bits.push_back((value >> static_cast<unsigned>(i) & 1) != 0);
}

// The CRC of a frame.
struct CheckSetup {
  std::uint32_t polynomial = 0x43;  // with its highest term
  int crc_bits = 6;
  std::uint32_t crc_start = 0;
  bool crc_inverted = true;
};

// The remainder of the message, followed by as many zeros as the polynomial has bits, by long division.
std::vector<bool> CheckBits(const CheckSetup& setup, std::vector<bool> message) {
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

// ---- events ----

// ---- the lines ----

// A BiSS-C encoder on its two lines, edge by edge, written from the SAA manual 5.6 alone. The clock's edges follow
// from the transfer; each rising one moves the encoder on, and what it puts on its line reaches the controller after
// the line's delay. The controller samples on the edges of its SPI mode.
//
// It complains, by counting, of whatever the encoder could not work with: a clock that does not idle high, or is too
// fast or too slow; words that are no bytes; a transfer before the time-out of the last one was over, or that ends
// before the frame does. The instants given to it must not run backwards.
class BissSimulator final : public UnitSimulator<ScriptedDevice<SimulatedEncoder>> {
 public:
  BissSimulator(const CheckSetup& setup, std::string name, const SimulatedEncoder& encoder, Script script)
      : UnitSimulator({{std::move(name), encoder, std::move(script)}}), setup_(setup) {
    line_.push_back({INT64_MIN, true});
  }

  void OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) override {
    CatchUp(now);
    ++counters_.transfers;
    std::fill(rx.begin(), rx.end(), std::uint8_t{0xFF});  // nobody pulls the line low
    const bool lost =
        encoder().fault.kind == Kind::kIntermittent && encoder().random.Share() < encoder().fault.amount;
    if (!Usable(transfer)) return;
    if (!encoder().powered || encoder().fault.kind == Kind::kOff || lost) {
      ++counters_.unanswered;
      phase_ = Phase::kIdle;
      line_ = {{INT64_MIN, true}};
    } else {
      Clock(transfer, now, rx);
    }
    Disturb(rx);
  }
  void OnDue(MonoNs now, const Transmit&) override { CatchUp(now); }

  // Traffic since the start, and complaints.
  struct Counters {
    std::int64_t transfers = 0;
    std::int64_t frames = 0;       // clocked out to their last bit
    std::int64_t unanswered = 0;   // off, without power, or by a fault
    std::int64_t wrong_mode = 0;   // the clock idles low: modes 0 and 1
    std::int64_t wrong_words = 0;  // words of other than 8 bits
    std::int64_t fast_clock = 0;   // a cycle of 100 ns or less (TMAS), a half of 25 ns or less
    std::int64_t slow_clock = 0;   // the clock rests for the time-out within a transfer
    std::int64_t early = 0;        // begun before the time-out of the last one was over
    std::int64_t cut = 0;          // ended while the encoder was in its frame
    std::int64_t near_edges = 0;   // sampled within 10 ns of a change: either level
  };

 private:
  // Where the encoder is in its frame. Each rising edge takes one step.
  enum class Phase : std::uint8_t {
    kIdle,     // the next edge latches
    kLatched,  // the next one acknowledges
    kBusy,     // acknowledged: low until it is ready
    kSending,
    kOver,  // low until the time-out
  };
  struct Change {
    MonoNs at = 0;
    bool level = true;
  };

  using Unit = ScriptedDevice<SimulatedEncoder>;
  [[nodiscard]] CounterList CountersOf(const Unit&) const override {
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
  [[nodiscard]] SimulatedEncoder& encoder() { return units().front().device; }
  [[nodiscard]] const SimulatedEncoder& encoder() const { return units().front().device; }
  [[nodiscard]] bool Usable(const SpiTransfer& transfer) {
    const std::int64_t clock = transfer.settings.clock_hz;
    const bool idles_high = (transfer.settings.mode & 2) != 0;
    const bool bytes = transfer.bits_per_word == 8;
    const bool slow_enough = clock > 0 && kSecond > kShortestCycle * clock && kSecond > 2 * kShortestHalf * clock;
    counters_.wrong_mode += idles_high ? 0 : 1;
    counters_.wrong_words += bytes ? 0 : 1;
    counters_.fast_clock += slow_enough ? 0 : 1;
    return idles_high && bytes && slow_enough;
  }
  void Clock(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) {
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
  [[nodiscard]] bool TimedOut(MonoNs at) const {
    return phase_ != Phase::kIdle && at >= last_edge_ + encoder().timeout();
  }
  void EndFrame() {
    Put(true, last_edge_ + encoder().timeout());
    phase_ = Phase::kIdle;
  }
  void OnRisingEdge(MonoNs at) {
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
        if (acknowledged_ < static_cast<int>(encoder().busy_clocks) || at - latched_ < encoder().busy()) break;
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
  void Send(MonoNs at) {
    Put(frame_[sent_++], at);
    if (sent_ < frame_.size()) return;
    ++counters_.frames;
    phase_ = Phase::kOver;
  }
  void Put(bool level, MonoNs at) {
    if (line_.back().level != level) line_.push_back({at + encoder().line_delay(), level});
  }
  // "a fixed logic 0 bit", then "position data, error bit, warning bit, and 6-bit negative-logic CRC"; "CRC covers
  // position data, error bit and warning bit". Turns precede the position, as BiSS defines it.
  void MakeFrame(MonoNs latched) {
    const ShaftAngle angle = encoder().Latch(latched);
    std::vector<bool> covered;
    PushBits(covered, TurnsFromAngle(angle, encoder().turn_bits), encoder().turn_bits);
    PushBits(covered, CountsFromAngle(angle, encoder().bits), encoder().bits);
    covered.push_back(!encoder().error);
    covered.push_back(!encoder().warning);
    const std::vector<bool> check = CheckBits(setup_, covered);
    frame_.assign(1, encoder().cds);
    frame_.insert(frame_.end(), covered.begin(), covered.end());
    frame_.insert(frame_.end(), check.begin(), check.end());
    sent_ = 0;
  }
  [[nodiscard]] bool LevelAt(MonoNs at) {
    while (line_.size() > 1 && line_[1].at + kSlew <= at) line_.pop_front();
    const bool settled = line_.size() == 1 || line_[1].at - kSlew >= at;
    if (settled) return line_.front().level;
    ++counters_.near_edges;
    return encoder().random.Share() < 0.5;
  }
  // What the wiring and a fault make of it.
  void Disturb(std::span<std::uint8_t> rx) {
    const SimulatedFault& fault = encoder().fault;
    const std::size_t left = fault.kind == Kind::kOff ? rx.size() : Damage(rx, fault, encoder().random);
    // A frame that ends early: nobody pulls the line low any more.
    std::fill(rx.begin() + static_cast<std::ptrdiff_t>(left), rx.end(), std::uint8_t{0xFF});
    for (std::uint8_t& byte : rx) {
      if (encoder().wiring == SimulatedEncoder::Wiring::kOpen) byte = 0xFF;
      if (encoder().wiring == SimulatedEncoder::Wiring::kShorted) byte = 0x00;
      if (encoder().wiring == SimulatedEncoder::Wiring::kSwapped) byte = static_cast<std::uint8_t>(~byte);
    }
  }

  CheckSetup setup_;
  Counters counters_;

  Phase phase_ = Phase::kIdle;
  MonoNs last_edge_ = 0;  // of the clock, rising; before any the phase is idle
  MonoNs latched_ = 0;
  int acknowledged_ = 0;     // clocks since the acknowledgement
  std::vector<bool> frame_;  // from the fixed 0 on
  std::size_t sent_ = 0;
  std::deque<Change> line_;  // as the controller will see it; the first one is in force
};

}  // namespace

std::unique_ptr<Simulator> MakeBissSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const DeviceConfig& device = bus.devices.front();
  const Format& format = Own(device).format;
  const std::size_t errors = simulate.errors().list().size();
  ConfigMap map = simulate.Named(device.name);
  const auto turn_bits = format.turn_bits > 0 ? std::optional(format.turn_bits) : std::nullopt;
  const SimulatedEncoder encoder(format.bits, format.turn_bits, ReadShaftStart(map, turn_bits));
  Script script = ReadScriptOf(map, encoder);
  if (simulate.errors().list().size() != errors) return nullptr;
  const CheckSetup setup{.polynomial = format.crc.polynomial,
                         .crc_bits = format.crc.bits,
                         .crc_start = format.crc.start,
                         .crc_inverted = format.crc.inverted};
  return std::make_unique<BissSimulator>(setup, device.name, encoder, std::move(script));
}

}  // namespace axlecast::biss
