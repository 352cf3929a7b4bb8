#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/base/time.h"
#include "core/device/operation.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::simulation {

// The random numbers of one part of a simulation: each part has its own, so that a fault that is left out changes nothing else.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t part)
      : numbers_(seed * 0x9E3779B97F4A7C15U + part * 0xD1B54A32D192ED03U) {}

  [[nodiscard]] double Share() { return numbers_.Share(); }
  [[nodiscard]] bool Happens(double share) { return share > 0 && Share() < share; }
  // In [least, most].
  [[nodiscard]] double Uniform(double least, double most) { return least + (most - least) * Share(); }
  [[nodiscard]] MonoNs Time(MonoNs least, MonoNs most) {
    return least + static_cast<MonoNs>(static_cast<double>(most - least) * Share());
  }
  // Exponentially distributed.
  [[nodiscard]] MonoNs Delay(MonoNs mean) {
    return static_cast<MonoNs>(-std::log(1 - Share()) * static_cast<double>(mean));
  }
  // In [0, count).
  [[nodiscard]] std::size_t Index(std::size_t count) { return static_cast<std::size_t>(numbers_.Next() % count); }
  [[nodiscard]] std::uint64_t Next() { return numbers_.Next(); }
  [[nodiscard]] CommandId Id() { return std::bit_cast<CommandId>(std::array{Next(), Next()}); }

 private:
  SeededRandom numbers_;
};

}  // namespace axlecast::simulation
