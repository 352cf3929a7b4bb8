#include "drivers/tformat/model.h"

#include <algorithm>
#include <array>

#include "drivers/kit/read_back.h"

namespace axlecast::tformat {
namespace {

constexpr std::array<Model, 2> kModels = {{
    // TS5669 spec 5.4.1, 5.4.2 and 6.3.3.
    {"ts5669n127", {.single_turn_bits = 17, .multi_turn_bits = 16}, 0x11, 6'000, 80'000},
    // Known from public captures only (golden/captures.txt); its mechanical limits are taken to be the TS5669's.
    {"smart_abs_23", {.single_turn_bits = 23, .multi_turn_bits = 16}, 0x17, 6'000, 80'000},
}};

// Spec 5.4.1, "Adjoining pitch error", either way.
constexpr int kPitchErrorArcSeconds = 40;

}  // namespace

std::span<const Model> Models() { return kModels; }

const Model* FindModel(std::string_view name) {
  const auto* found = std::find_if(kModels.begin(), kModels.end(), [&](const Model& m) { return m.name == name; });
  return found == kModels.end() ? nullptr : found;
}

std::int64_t NoiseCounts(int single_turn_bits) { return NoiseOfAccuracy(kPitchErrorArcSeconds, single_turn_bits); }

std::int64_t ZeroToleranceCounts(int single_turn_bits) {
  return static_cast<std::int64_t>(kZeroToleranceDeg / 360 *
                                   static_cast<double>(std::int64_t{1} << single_turn_bits));
}

}  // namespace axlecast::tformat
