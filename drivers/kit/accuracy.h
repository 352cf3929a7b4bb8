#pragma once

#include <cstdint>

namespace axlecast {

// The largest difference in counts, rounded up, between two readings of one place by an encoder whose maker gives an
// accuracy of +- `arc_seconds`: one may be off by that much to one side, the other to the other side. At least 1.
[[nodiscard]] std::int64_t NoiseOfAccuracy(int arc_seconds, int single_turn_bits);

}  // namespace axlecast
