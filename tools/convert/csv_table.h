#pragma once

#include "tools/convert/conversion.h"
#include "tools/convert/event_range.h"

namespace axlecast {

// The messages as they are, one row each: `log_utime` (us, reception), `channel`, and the fields of all types that
// occur, under their names in JSON ("accel_mps2[0]"). A field that a message has not, and a number that is not known,
// is empty. Messages that are none of ours, or malformed, are left out.
[[nodiscard]] Conversion WriteCsvTable(const EventRange& events, const Output& out);

}  // namespace axlecast
