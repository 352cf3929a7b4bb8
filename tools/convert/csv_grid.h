#pragma once

#include <cstdint>

#include "tools/convert/conversion.h"
#include "tools/convert/event_range.h"

namespace axlecast {

struct TimeGrid {
  std::int64_t period_us = 0;   // rows at its multiples, UNIX time; above 0
  std::int64_t max_age_us = 0;  // of a reading; 0: as DEVICE says
};

// All devices' positions on one time grid: `utime`, then of each POSITION channel its `value`, `counts` (both on the
// line between the readings around the row's instant) and `flags` (of the reading before). Empty where there is none:
// no valid reading, a datum that was changed in between, or readings further apart than the maximum age. `all`: where
// the devices' DEVICE messages are looked for, which `value` needs. Messages that are no positions are left out.
[[nodiscard]] Conversion WriteCsvGrid(const EventRange& events, const EventRange& all, const TimeGrid& grid,
                                      const Output& out);

}  // namespace axlecast
