#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/replay/merged_logs.h"

namespace axlecast {

// A time that a user named.
struct ReplayTime {
  // `us` is UNIX time; else it counts from the logs' first event, or if it is negative from their last one.
  bool unix_time = false;
  std::int64_t us = 0;
  bool operator==(const ReplayTime&) const = default;
};

// The part of the logs that is wished for.
struct ReplayWish {
  std::optional<ReplayTime> from = std::nullopt;         // from the first event that is not before it
  std::optional<ReplayTime> to = std::nullopt;           // up to the first event that is not before it
  std::int64_t start_event = 0;                          // from this event on, counted from 0 over all of the logs
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

// Bookkeeping events (IsLogChannel) count, but a time is not reckoned from them.
[[nodiscard]] ReplayRange FindRange(const std::vector<Bytes>& logs, const ReplayWish& wish);

}  // namespace axlecast
