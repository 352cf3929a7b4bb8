#include "drivers/tformat/reset_rules.h"

#include "core/device/operation.h"
#include "drivers/tformat/model.h"

namespace axlecast::tformat {

bool TurnsAreReset(const Reply& all, const TFormatSettings& settings) {
  const std::uint32_t turns = *all.multi_turn;
  if (turns == 0) return true;
  if (!IsZero(all, settings)) return false;
  const std::uint32_t last = (1U << static_cast<unsigned>(settings.format.multi_turn_bits)) - 1;
  const bool low_half = *all.single_turn < settings.counts_per_turn / 2;
  return low_half ? turns == 1 : turns == last;
}

bool IsZero(const Reply& all, const TFormatSettings& settings) {
  return CircularDistance(*all.single_turn, 0, settings.counts_per_turn) <=
         ZeroToleranceCounts(settings.format.single_turn_bits);
}

}  // namespace axlecast::tformat
