#include "drivers/saa/data_sheet.h"

#include <algorithm>

#include "drivers/kit/command_runner.h"

namespace axlecast::saa {

std::optional<int> AccuracyArcSeconds(int bits) {
  constexpr int kFirst = 16;
  constexpr std::array<int, 11> kArcSeconds = {40, 20, 20, 15, 15, 10, 8, 6, 5, 5, 5};  // of 16 to 26 bits
  if (bits < kFirst) return std::nullopt;
  return kArcSeconds.at(static_cast<std::size_t>(std::min(bits, kMaxBits) - kFirst));
}

std::int64_t NoiseCounts(int bits) {
  const std::optional<int> accuracy = AccuracyArcSeconds(bits);
  return accuracy ? NoiseOfAccuracy(*accuracy, bits) : 1;
}

}  // namespace axlecast::saa
