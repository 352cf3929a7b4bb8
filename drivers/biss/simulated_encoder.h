#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast::biss {

// One BiSS-C encoder and its line, with all that a file, a script or an operator can set. Binary; counts rise
// counter-clockwise, which is our reading: the manual does not state it.
class SimulatedEncoder final : public TableDevice<SimulatedEncoder> {
 public:
  // What is wrong with the line, besides a fault.
  enum class Wiring : std::uint8_t { kGood, kOpen, kShorted, kSwapped };

  SimulatedEncoder(int bits, int turn_bits, ShaftAngle angle, std::uint64_t seed)
      : bits_(bits), turn_bits_(turn_bits), shaft_(angle), random_(seed) {}

  void Advance(MonoNs now) override { now_ = now; }
  [[nodiscard]] static const QuantityTable<SimulatedEncoder>& Table();
  // Every quantity with its present value, then what it would send now.
  [[nodiscard]] QuantityList Quantities() const;

  // What it latches at `at`, which may be a little later than the last Advance.
  struct Latched {
    std::uint64_t position = 0;
    std::uint64_t turns = 0;
  };
  [[nodiscard]] Latched Latch(MonoNs at);

  [[nodiscard]] int bits() const { return bits_; }
  [[nodiscard]] int turn_bits() const { return turn_bits_; }
  [[nodiscard]] bool powered() const { return powered_; }
  [[nodiscard]] bool error() const { return error_; }
  [[nodiscard]] bool warning() const { return warning_; }
  [[nodiscard]] bool cds() const { return cds_; }  // the fixed 0 is sent as 1
  [[nodiscard]] Wiring wiring() const { return wiring_; }
  [[nodiscard]] const SimulatedFault& fault() const { return fault_; }
  [[nodiscard]] SeededRandom& random() { return random_; }
  [[nodiscard]] MonoNs line_delay() const;
  [[nodiscard]] MonoNs byte_gap() const;
  [[nodiscard]] MonoNs timeout() const;
  [[nodiscard]] MonoNs busy() const;  // from latching to the start bit, at least
  [[nodiscard]] int busy_clocks() const { return static_cast<int>(busy_clocks_); }  // of acknowledgement, at least

 private:
  [[nodiscard]] Result<> SetFault(std::string_view text);
  [[nodiscard]] Latched At(ShaftAngle angle) const;

  int bits_;
  int turn_bits_;
  Shaft shaft_;
  SeededRandom random_;
  MonoNs now_ = 0;
  ShaftAngle stuck_at_ = 0;
  SimulatedFault fault_;
  Wiring wiring_ = Wiring::kGood;
  bool powered_ = true;
  bool error_ = false;
  bool warning_ = false;
  bool cds_ = false;
  double line_delay_ns_ = 60;
  double byte_gap_us_ = 0;
  double timeout_us_ = 16;
  double busy_us_ = 0;
  double busy_clocks_ = 2;
  double noise_counts_ = 0;
};

}  // namespace axlecast::biss
