#include "drivers/kit/accuracy.h"

#include <algorithm>

namespace axlecast {

std::int64_t NoiseOfAccuracy(int arc_seconds, int single_turn_bits) {
  constexpr std::int64_t kPerTurn = 360 * 3'600;
  const std::int64_t scaled = 2 * std::int64_t{arc_seconds} << static_cast<unsigned>(single_turn_bits);
  return std::max<std::int64_t>(1, (scaled + kPerTurn - 1) / kPerTurn);
}

}  // namespace axlecast
