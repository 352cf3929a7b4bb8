#pragma once

#include <cstdint>

#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::saa_can::cia406 {

// The measuring part of a simulated encoder: a position value of `bits` a turn and `turn_bits` turns, as CiA 406
// has it in 6004h.
struct SimulatedShaftEncoder {
  int bits = 13;
  int turn_bits = 12;
  bool ccw = false;  // counts rise counter-clockwise: code sequence, bit 0 of 6000h
  Shaft shaft;
  std::uint32_t offset = 0;  // 6509h: what a preset adds
  double noise_counts = 0;
  bool stuck = false;
  ShaftAngle stuck_at = 0;

  [[nodiscard]] std::uint64_t range() const { return std::uint64_t{1} << static_cast<unsigned>(bits + turn_bits); }
  [[nodiscard]] std::uint32_t Position(MonoNs at) const {
    return static_cast<std::uint32_t>((Measured(at) + offset) & (range() - 1));
  }
  [[nodiscard]] std::uint32_t NoisyPosition(MonoNs at, SeededRandom& random) const {
    const auto bound = static_cast<std::int64_t>(noise_counts);
    const std::int64_t error = bound == 0 ? 0 : random.Around(bound);
    return static_cast<std::uint32_t>((Position(at) + static_cast<std::uint64_t>(error)) & (range() - 1));
  }
  // The position at `at` reads `value` from here on.
  void Preset(std::uint32_t value, MonoNs at) {
    offset = static_cast<std::uint32_t>((value - Measured(at)) & (range() - 1));
  }

 private:
  [[nodiscard]] std::uint64_t Measured(MonoNs at) const {
    const ShaftAngle angle = stuck ? stuck_at : shaft.At(at).angle;
    const std::int64_t counts = (ccw ? angle : -angle) >> static_cast<unsigned>(kTurnBits - bits);
    return static_cast<std::uint64_t>(counts);
  }
};

}  // namespace axlecast::saa_can::cia406
