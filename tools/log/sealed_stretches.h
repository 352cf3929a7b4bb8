#pragma once

#include <cstddef>
#include <cstdint>

#include "tools/log/log_event.h"

namespace axlecast {

// Reads a log from seal to seal, also while it grows. A stretch is the records between two seals: about 1 s of messages. Only the
// CRC of the seal shows that its records are as they were recorded.

// A place in a log, behind a seal or at its start.
struct LogPlace {
  std::int64_t number = 0;  // of the next event; numbers stay when a log is repaired
  std::size_t offset = 0;   // of its record, in bytes; another after a repair
  bool operator==(const LogPlace&) const = default;
};

struct LogStretch {
  enum class Kind : std::uint8_t {
    kIncomplete,  // no seal follows yet
    kSealed,      // `records` are verified by `seal`
    kUnsealed,    // the end of a closed log: `records` are whole, but nothing verifies them
    kDamaged,     // nothing verifies the events up to `next`, or they are missing
  };

  Kind kind = Kind::kIncomplete;
  Bytes records = {};         // kSealed, kUnsealed: from the place on, without the seal's record
  LogPlace next = {};         // behind the stretch; kIncomplete: the place itself
  LogSeal seal = {};          // kSealed
  std::uint64_t bytes = 0;    // kDamaged: the bytes of the log that are skipped; 0 if a repair has removed them
  std::int64_t messages = 0;  // kDamaged: the events that are skipped, without the seal; -1: unknown
};

// The size of the record of a seal.
inline constexpr std::size_t kSealRecord = kEventHeader + kSealChannel.size() + 20;

// The greatest size of the records of an unsealed stretch, unless a single record is greater.
inline constexpr std::size_t kUnsealedBytes = 1U << 20;

// Returns the stretch behind `place`, which FindPlace or a stretch before it has returned. `closed`: nobody will add to the log, so
// records behind its last seal are returned as well. Such a stretch may be followed by a seal after all, if the log was not closed:
// the next stretch then contains only the records that were not returned before.
//
// Bytes that no seal verifies become kDamaged: from the place to the next records that a seal verifies, or behind the next seal. The
// place always moves on, by the numbers of the events: no event is returned twice, and whatever the log contains, kIncomplete is
// returned only if no seal follows (or, of a closed log, at its end).
[[nodiscard]] LogStretch NextStretch(Bytes log, const LogPlace& place, bool closed);

// Finds the place at which `number` is the next event. `hint`: the offset where it was. Reads the log from its start if the hint is
// wrong, which happens if the log was repaired. If a seal is missing there, the place is the one behind the last event before
// `number` that the log has.
[[nodiscard]] LogPlace FindPlace(Bytes log, std::int64_t number, std::size_t hint);

}  // namespace axlecast
