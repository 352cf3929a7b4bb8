#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/time.h"
#include "drivers/kit/simulation/shaft_encoder.h"

namespace axlecast::ssi {

// Levels of a data word, the first to be sent in front.
using Levels = std::vector<bool>;

// How a simulated encoder lays out what it sends. Places count from 0, the first that is sent.
struct SimulatedWord {
  struct Flag {
    std::string name;
    int place = 0;
    bool active_level = true;
  };

  int length = 12;
  int position_at = 0;  // of the multi-turn bits, and the single-turn bits behind them
  int turn_bits = 0;
  int bits = 12;
  bool gray = false;
  bool one_gray_code = true;  // over both parts; false: one each
  std::vector<Flag> flags = {};
  int parity_at = -1;  // -1: none
  bool parity_odd = false;

  // The word of a shaft at `counts` in turn `turns`, with these flags raised (by their order, as bits).
  [[nodiscard]] Levels Make(std::uint32_t turns, std::uint32_t counts, std::uint32_t raised) const;
};

// The serial side of an encoder: monoflop, shift register and data line, edge by edge (TWK SSI 4; SAA manual 5.5).
// Instants are those at which the host sees or makes an edge, and do not run backwards.
class SimulatedOutput {
 public:
  enum class AfterWord : std::uint8_t { kZeros, kOneZero, kNoGap };

  void SetMonoflop(MonoNs time) { monoflop_ = time; }
  void SetAfterWord(AfterWord after) { after_ = after; }

  // "The first negative edge sets the monoflop and stores the data", fetched from `latch`; each further one retriggers
  // it.
  void Fall(MonoNs at, const std::function<Levels(MonoNs at)>& latch);
  // "Each further positive edge causes the next highest bit to be transferred."
  void Rise(MonoNs at);
  // The encoder lost its supply for a moment.
  void Reset(MonoNs at);
  // The level of the data line just before `at`.
  [[nodiscard]] bool LevelBefore(MonoNs at);

  // The monoflop still runs.
  [[nodiscard]] bool IsSet(MonoNs at) const { return set_ && at < expires_; }
  [[nodiscard]] const Levels& word() const { return word_; }

 private:
  struct Change {
    MonoNs at = 0;
    bool level = true;
  };

  void RunDown(MonoNs now);
  [[nodiscard]] bool LevelOf(std::size_t clocks) const;

  MonoNs monoflop_ = 0;
  AfterWord after_ = AfterWord::kZeros;
  bool set_ = false;
  MonoNs expires_ = 0;
  Levels word_;
  std::size_t clocks_ = 0;  // positive edges since the word was stored
  bool level_ = true;       // before the first of changes_
  std::deque<Change> changes_;
};

// One encoder with its cable, as the makers describe both: all that a file, a script or a person can set. Counts rise
// counter-clockwise (our reading: neither document states it).
struct SimulatedEncoder final : ShaftEncoder<SimulatedEncoder> {
  enum class DataLine : std::uint8_t { kEncoder, kHigh, kLow, kSwapped };

  // The properties from the file.
  struct Properties {
    SimulatedWord word = {};
    double monoflop_us = 25;
    SimulatedOutput::AfterWord after_word = SimulatedOutput::AfterWord::kZeros;
    double cable_m = 0;
    double electronics_ns = 300;  // t_C + t_E
    double cable_ns_per_m = 6.5;
  };

  SimulatedEncoder(Properties described, const ShaftStart& start)
      : ShaftEncoder(start), properties(std::move(described)) {}

  [[nodiscard]] static const QuantityTable<SimulatedEncoder>& Table();
  // Every quantity with its present value, then what it would send now.
  [[nodiscard]] QuantityList Quantities() const;

  // The data word of the position at `at`.
  [[nodiscard]] Levels WordAt(MonoNs at);
  [[nodiscard]] MonoNs monoflop() const;
  [[nodiscard]] MonoNs delay() const;     // t_TD = t_C + 2 x t_CA + t_E, TWK SSI 11.3
  [[nodiscard]] MonoNs byte_gap() const;  // of the host's controller, between two bytes
  [[nodiscard]] Result<> SetStatus(std::string_view text);
  [[nodiscard]] std::string StatusText() const;

  Properties properties;
  DataLine data_line = DataLine::kEncoder;
  double byte_gap_us = 0;
  double noise_counts = 0;
  std::uint32_t raised = 0;  // flags
};

// One encoder on SSI, edge by edge: what the host samples follows from its mode and clock, the line's delay, and the
// encoder's monoflop and shift register. Written from TWK's description and SAA's manual alone; what the host does
// against them is counted. The instants given to it must not run backwards.
class SsiSimulator final : public UnitSimulator<ScriptedDevice<SimulatedEncoder>> {
 public:
  // The clock that the encoder takes.
  struct ClockRange {
    double min_hz = 0;  // must be above it
    double max_hz = 0;  // and below this
  };

  SsiSimulator(std::string device, SimulatedEncoder encoder, Script script, ClockRange range);

  void OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) override;
  void OnDue(MonoNs now, const Transmit&) override { CatchUp(now); }

  // Traffic since the start.
  struct Counters {
    std::int64_t transfers = 0;
    std::int64_t latches = 0;     // positions stored: more than one in a transfer when the monoflop runs down in it
    std::int64_t unanswered = 0;  // off, without power, or by a fault
    std::int64_t wrong_mode = 0;  // not mode 2: idle high, sampled at the falling edge
    std::int64_t slow_clocks = 0;    // a cycle as long as the monoflop, or below the encoder's lowest clock
    std::int64_t fast_clocks = 0;    // above the encoder's highest clock: it sends anything
    std::int64_t late_data = 0;      // half a cycle is shorter than the line's delay: old bits are sampled
    std::int64_t short_pauses = 0;   // begun before the monoflop had run down: more of the old word
    std::int64_t few_clocks = 0;     // not n + 1 falling edges for a word of n bits
    std::int64_t monoflop_ends = 0;  // transfers in which the monoflop ran down
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const SimulatedEncoder& encoder() const { return units().front().device; }

 private:
  using Unit = ScriptedDevice<SimulatedEncoder>;
  void CatchUp(MonoNs now) override;
  [[nodiscard]] CounterList CountersOf(const Unit& unit) const override;
  [[nodiscard]] SimulatedEncoder& encoder() { return units().front().device; }
  void Complain(const SpiTransfer& transfer, MonoNs now);
  void ClockOut(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx);
  void Edge(bool falling, MonoNs at);
  [[nodiscard]] bool Sampled(MonoNs at);
  void Disturb(const SpiTransfer& transfer, bool fast, std::span<std::uint8_t> rx);
  [[nodiscard]] bool Answers();

  ClockRange range_;
  SimulatedOutput output_;
  Counters counters_;
};

}  // namespace axlecast::ssi
