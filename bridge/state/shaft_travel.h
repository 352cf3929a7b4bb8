#pragma once

#include <cstdint>
#include <string>

#include "bridge/store/axis_store.h"
#include "core/config/machine_config.h"

namespace axlecast {

// How far a shaft went while nobody watched it, as far as its encoder can tell.
struct ShaftTravel {
  enum class Verdict : std::uint8_t {
    kResting,       // within what two readings at rest may differ
    kWithinWindow,  // less than a quarter of what the turns counter can hold: the figure can be trusted
    kBeyondWindow,  // more: it may as well have gone the other way round, or round several times
    kTurnsUnknown,  // a single-turn encoder: any number of whole turns may come on top
  };
  Verdict verdict = Verdict::kResting;
  std::int64_t counts = 0;  // the shortest way from `before` to `after`
  double turns = 0;
};

// `before` and `after`: counts after direction, before the datum, of an axis with these settings.
[[nodiscard]] ShaftTravel Travelled(const DeviceConfig& device, std::int64_t before, std::int64_t after);

// "moved by 3.2000 turns within 65536 turns in 12 s while its driver was away"
[[nodiscard]] std::string TravelText(const ShaftTravel& travel, const DeviceConfig& device, std::int64_t away_us);

}  // namespace axlecast
