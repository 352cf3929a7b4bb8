#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "drivers/biss/simulated_encoder.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast::biss {

// A BiSS-C encoder on its two lines, edge by edge, written from the SAA manual 5.6 alone. The clock's edges follow
// from the transfer; each rising one moves the encoder on, and what it puts on its line reaches the controller after
// the line's delay. The controller samples on the edges of its SPI mode.
//
// It complains, by counting, of whatever the encoder could not work with: a clock that does not idle high, or is too
// fast or too slow; words that are no bytes; a transfer before the time-out of the last one was over, or that ends
// before the frame does. The instants given to it must not run backwards.
class BissSimulator final : public UnitSimulator<ScriptedDevice<SimulatedEncoder>> {
 public:
  struct Setup {
    std::uint32_t polynomial = 0x43;  // with its highest term
    int crc_bits = 6;
    std::uint32_t crc_start = 0;
    bool crc_inverted = true;
  };

  BissSimulator(const Setup& setup, std::string name, const SimulatedEncoder& encoder, Script script);

  void OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) override;
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
  [[nodiscard]] const Counters& counters() const { return counters_; }

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
  [[nodiscard]] CounterList CountersOf(const Unit& unit) const override;
  [[nodiscard]] SimulatedEncoder& encoder() { return units().front().device; }
  [[nodiscard]] const SimulatedEncoder& encoder() const { return units().front().device; }
  [[nodiscard]] bool Usable(const SpiTransfer& transfer);
  void Clock(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx);
  [[nodiscard]] bool TimedOut(MonoNs at) const;
  void EndFrame();
  void OnRisingEdge(MonoNs at);
  void Send(MonoNs at);
  void Put(bool level, MonoNs at);
  void MakeFrame(MonoNs latched);
  [[nodiscard]] bool LevelAt(MonoNs at);
  void Disturb(std::span<std::uint8_t> rx);

  Setup setup_;
  Counters counters_;

  Phase phase_ = Phase::kIdle;
  MonoNs last_edge_ = 0;  // of the clock, rising; before any the phase is idle
  MonoNs latched_ = 0;
  int acknowledged_ = 0;     // clocks since the acknowledgement
  std::vector<bool> frame_;  // from the fixed 0 on
  std::size_t sent_ = 0;
  std::deque<Change> line_;  // as the controller will see it; the first one is in force
};

}  // namespace axlecast::biss
