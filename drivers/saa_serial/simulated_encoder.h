#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast::saa_serial {

// One encoder of the SAA series as the maker describes it, and the state of its line, with all that a file, a script or
// an operator can set. Single-turn, binary; counts rise counter-clockwise, which is our reading: the manual does not
// state it.
class SimulatedEncoder final : public TableDevice<SimulatedEncoder> {
 public:
  SimulatedEncoder(int bits, ShaftAngle angle, std::uint64_t seed) : bits_(bits), shaft_(angle), random_(seed) {}

  void Advance(MonoNs now) override { now_ = now; }
  [[nodiscard]] static const QuantityTable<SimulatedEncoder>& Table();
  // Every quantity with its present value, then what it would send now and how often it was zeroed.
  [[nodiscard]] QuantityList Quantities() const;

  // What it samples at `at`, which may be a little later than the last Advance.
  [[nodiscard]] std::uint32_t Sample(MonoNs at);
  // The position at `at` becomes zero.
  void ClearToZero(MonoNs at);

  [[nodiscard]] int bits() const { return bits_; }
  [[nodiscard]] bool powered() const { return powered_; }
  [[nodiscard]] const SimulatedFault& fault() const { return fault_; }
  [[nodiscard]] SeededRandom& random() { return random_; }
  [[nodiscard]] MonoNs processing() const;  // T3: from the request or the refresh instant to the first bit
  [[nodiscard]] bool unpaced() const { return unpaced_; }
  [[nodiscard]] bool sends_address() const { return sends_address_; }  // in the second byte, instead of 81H
  [[nodiscard]] double refresh_hz() const { return refresh_hz_; }      // 0: as configured
  [[nodiscard]] std::int64_t zeroings() const { return zeroings_; }

 private:
  [[nodiscard]] Result<> SetFault(std::string_view text);
  [[nodiscard]] std::uint32_t CountsAt(ShaftAngle angle) const;

  int bits_;
  Shaft shaft_;
  SeededRandom random_;
  MonoNs now_ = 0;
  ShaftAngle zero_ = 0;
  ShaftAngle stuck_at_ = 0;
  SimulatedFault fault_;
  bool powered_ = true;
  bool unpaced_ = false;
  bool sends_address_ = false;
  double processing_us_ = 20;
  double refresh_hz_ = 0;
  double noise_counts_ = 0;
  double zero_error_deg_ = 0;
  std::int64_t zeroings_ = 0;
};

}  // namespace axlecast::saa_serial
