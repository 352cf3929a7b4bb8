#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"
#include "drivers/ssi/simulated_output.h"

namespace axlecast::ssi {

// One encoder with its cable, as the makers describe both: all that a file, a script or a person can set. Counts rise
// counter-clockwise (our reading: neither document states it).
class SimulatedEncoder final : public TableDevice<SimulatedEncoder> {
 public:
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

  SimulatedEncoder(Properties properties, ShaftAngle angle, std::uint64_t seed)
      : properties_(std::move(properties)), shaft_(angle), random_(seed) {}

  void Advance(MonoNs now) override { now_ = now; }
  [[nodiscard]] static const QuantityTable<SimulatedEncoder>& Table();
  // Every quantity with its present value, then what it would send now.
  [[nodiscard]] QuantityList Quantities() const;

  // The data word of the position at `at`.
  [[nodiscard]] Levels WordAt(MonoNs at);

  [[nodiscard]] const Properties& properties() const { return properties_; }
  [[nodiscard]] MonoNs monoflop() const;
  [[nodiscard]] MonoNs delay() const;     // t_TD = t_C + 2 x t_CA + t_E, TWK SSI 11.3
  [[nodiscard]] MonoNs byte_gap() const;  // of the host's controller, between two bytes
  [[nodiscard]] DataLine data_line() const { return data_line_; }
  [[nodiscard]] bool powered() const { return powered_; }
  [[nodiscard]] const SimulatedFault& fault() const { return fault_; }
  [[nodiscard]] SeededRandom& random() { return random_; }

 private:
  [[nodiscard]] Result<> SetStatus(std::string_view text);
  [[nodiscard]] std::string StatusText() const;
  [[nodiscard]] Result<> SetFault(std::string_view text);
  struct Place {
    std::uint32_t turns = 0;
    std::uint32_t counts = 0;
  };
  [[nodiscard]] Place PlaceAt(ShaftAngle angle) const;

  Properties properties_;
  Shaft shaft_;
  SeededRandom random_;
  MonoNs now_ = 0;
  ShaftAngle stuck_at_ = 0;
  SimulatedFault fault_;
  bool powered_ = true;
  DataLine data_line_ = DataLine::kEncoder;
  double byte_gap_us_ = 0;
  double noise_counts_ = 0;
  std::uint32_t raised_ = 0;  // flags
};

}  // namespace axlecast::ssi
