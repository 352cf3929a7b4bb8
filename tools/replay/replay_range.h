#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/log/log_merge.h"
#include "tools/log/log_span.h"

namespace axlecast {

// The part of the logs that is wished for.
struct ReplayWish {
  std::optional<std::int64_t> from = std::nullopt;   // us, UNIX time: from the first event that is not before it
  std::optional<std::int64_t> until = std::nullopt;  // likewise: up to the first event that is not before it
  std::int64_t start_event = 0;                      // from this event on, counted from 0 over all of the logs
  std::optional<std::int64_t> end_event = std::nullopt;  // up to this one, which is not played any more
};

// The part of the logs that is played.
struct ReplayRange {
  LogPosition begin;
  LogPosition end;
  std::int64_t begin_utime = 0;  // of the first event, or the time that was wished for
  std::int64_t end_utime = 0;    // likewise of the last one
  bool empty = true;             // not a single event
};

// Bookkeeping events (IsLogChannel) count, but do not begin the range's time.
[[nodiscard]] ReplayRange FindRange(const std::vector<Bytes>& logs, const ReplayWish& wish);

}  // namespace axlecast
