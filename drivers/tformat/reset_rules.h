#pragma once

#include "core/base/time.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

// TS5669 spec 9: "Transmit 10 times in one sequence with the interval of 40 ms or more".
inline constexpr int kResetTimes = 10;
// From the end of one request's reply to the next request: the encoder's own 40 ms and a margin for both clocks.
// The reply proves that its request has arrived, whatever the adapter's delays.
inline constexpr MonoNs kResetInterval = 41 * kMillisecond;
// Requests of one sequence that the encoder may answer with a communication alarm, which says that it did not understand
// them. Each is sent again (spec 6.3.2 (4)).
inline constexpr int kMaxAlarmedRequests = 5;
// From the last request to its effect: "maximum 18 ms" (spec 9, for the zero; 8.1, for an EEPROM cell), with a
// margin.
inline constexpr MonoNs kWriteTime = 20 * kMillisecond;

[[nodiscard]] constexpr bool IsReset(DataId id) {
  return id == DataId::kClearErrors || id == DataId::kZeroSingleTurn || id == DataId::kResetTurnsAndErrors;
}

// The multi-turn counter is 0, or one beside it while the shaft stands on the border between two turns.
[[nodiscard]] bool TurnsAreReset(const Reply& all, const TFormatSettings& settings);
// The single-turn position is 0 within the maker's 0.35 degrees.
[[nodiscard]] bool IsZero(const Reply& all, const TFormatSettings& settings);

}  // namespace axlecast::tformat
