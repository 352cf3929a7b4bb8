#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "tools/convert/conversion.h"

namespace axlecast {

// Returns one CSV record according to RFC 4180, with CR LF at its end. Cells with commas, quotes or line ends are quoted.
// Bytes that are not UTF-8, and NUL, become U+FFFD. Spreadsheets interpret a cell that begins with = + - @, tab or CR as
// a formula: such a cell gets a leading apostrophe, unless it is a number.
[[nodiscard]] std::string CsvLine(const std::vector<std::string>& cells);

// Writes one row for each message: `log_utime` (us, reception), `channel`, and the fields of all types that occur, under
// their JSON names ("accel_mps2[0]"). Fields that a message does not have, and null, are empty. Malformed messages and
// messages of other programs are left out.
[[nodiscard]] Conversion WriteCsvTable(const EventRange& events, const Output& out);

struct TimeGrid {
  std::int64_t period_us = 0;   // rows are at its multiples of UNIX time; above 0
  std::int64_t max_age_us = 0;  // of a reading; 0: the limit in the device's DEVICE message
};

// Writes the positions of all devices on one time grid: `utime`, then `value`, `counts` and `flags` of each POSITION
// channel. `value` and `counts` are interpolated between the readings before and after the row; `flags` are from the
// reading before. They are empty
// - without a valid reading,
// - between readings with a different datum,
// - between readings further apart than the maximum age.
// `value` needs the DEVICE messages, which are searched in `all`. Messages that are no positions are left out.
[[nodiscard]] Result<Conversion> WriteCsvGrid(const EventRange& events, const EventRange& all, const TimeGrid& grid,
                                              const Output& out);

}  // namespace axlecast
