#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/kit/simulation/script.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::saa_serial {

// One encoder of the SAA series as the maker describes it, and the state of its line: all that a file, a script or a
// person can set. Single-turn, binary, counting up counter-clockwise (our reading; the manual does not say).
class SimulatedEncoder final : public SimulatedDevice {
 public:
  SimulatedEncoder(int bits, ShaftAngle angle, std::uint64_t seed) : bits_(bits), shaft_(angle), random_(seed) {}

  void Advance(MonoNs now) override { now_ = now; }
  [[nodiscard]] Result<> Set(std::string_view name, std::string_view value) override;
  [[nodiscard]] static const std::vector<std::string_view>& QuantityNames();
  // Every quantity with its present value, then what it would send now and what was done to it.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> Quantities() const;

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
  [[nodiscard]] bool says_address() const { return says_address_; }  // in the second byte, instead of 81H
  [[nodiscard]] double refresh_hz() const { return refresh_hz_; }    // 0: as configured
  [[nodiscard]] std::int64_t zeroings() const { return zeroings_; }

 private:
  friend struct EncoderQuantities;

  [[nodiscard]] std::uint32_t CountsAt(ShaftAngle angle) const;

  int bits_;
  Shaft shaft_;
  SeededRandom random_;
  MonoNs now_ = 0;
  ShaftAngle zero_ = 0;
  ShaftAngle stuck_at_ = 0;
  std::string motion_ = "constant";
  SimulatedFault fault_;
  bool powered_ = true;
  bool unpaced_ = false;
  bool says_address_ = false;
  double processing_us_ = 20;
  double refresh_hz_ = 0;
  double noise_counts_ = 0;
  double zero_error_deg_ = 0;
  std::int64_t zeroings_ = 0;
};

}  // namespace axlecast::saa_serial
