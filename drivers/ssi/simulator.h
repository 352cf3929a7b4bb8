#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/device/simulator.h"
#include "drivers/kit/simulation/script.h"
#include "drivers/ssi/simulated_encoder.h"
#include "drivers/ssi/simulated_output.h"

namespace axlecast::ssi {

// One encoder on SSI, edge by edge: what the host samples follows from its mode and clock, the line's delay, and the
// encoder's monoflop and shift register. Written from TWK's description and SAA's manual alone; what the host does
// against them is counted. The instants given to it must not run backwards.
class SsiSimulator final : public Simulator {
 public:
  // The clock that the encoder takes.
  struct ClockRange {
    double least_hz = 0;  // must be above it
    double most_hz = 0;   // and below this
  };

  SsiSimulator(std::string device, SimulatedEncoder encoder, Script script, ClockRange range);

  void OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) override;
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Transmit& transmit) override;
  [[nodiscard]] std::string Set(std::string_view device, std::string_view key, std::string_view value,
                                MonoNs now) override;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view device,
                                                                       MonoNs now) const override;

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
  [[nodiscard]] const SimulatedEncoder& encoder() const { return encoder_; }

 private:
  void CatchUp(MonoNs now);
  void Complain(const SpiTransfer& transfer, MonoNs now);
  void ClockOut(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx);
  void Edge(bool falling, MonoNs at);
  [[nodiscard]] bool Sampled(MonoNs at);
  void Disturb(const SpiTransfer& transfer, bool fast, std::span<std::uint8_t> rx);
  [[nodiscard]] bool Answers();

  std::string device_;
  SimulatedEncoder encoder_;
  Script script_;
  ClockRange range_;
  SimulatedOutput output_;
  Counters counters_;
  bool started_ = false;
};

}  // namespace axlecast::ssi
