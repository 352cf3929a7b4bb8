#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {

// us, 36,000 years. Damaged times are limited to this value, so that sums and differences of them do not overflow.
inline constexpr std::int64_t kFarthestUtime = INT64_MAX / 8;

// The times at which the first and the last message of one or several logs were received: us, UNIX time. 0: no message.
struct LogSpan {
  std::int64_t first = 0;
  std::int64_t last = 0;
};

// Reads a few events at both ends. Events of the log itself (IsLogChannel) do not count as its first message.
[[nodiscard]] LogSpan SpanOf(const std::vector<Bytes>& logs);

// A position in several logs: the offset of the next record in each.
using LogPosition = std::vector<std::size_t>;

// The events of one or several logs as one sequence, ordered by time. If times are equal, the log that was named first comes
// first. The order within a log is kept, even if its times run back.
class LogMerge {
 public:
  explicit LogMerge(const std::vector<Bytes>& logs);

  // Returns the next event, or null at the end. It is valid until the position changes; its views refer to its log.
  [[nodiscard]] const LogEvent* Head() const {
    return heap_.empty() ? nullptr : &lanes_[heap_.front()].head->event;
  }
  [[nodiscard]] std::size_t HeadLog() const { return heap_.front(); }  // index of its log
  // Returns the time of the next event. If a single event has a time outside those of its neighbours, which damage can cause,
  // the nearest time of a neighbour is returned. An event of the log itself (IsLogChannel) has the time of its neighbours. The
  // result is within kFarthestUtime.
  [[nodiscard]] std::int64_t HeadUtime() const { return lanes_[heap_.front()].utime; }
  void Advance();
  // Skips events of the logs themselves. Returns the time of the next message, or nothing at the end.
  std::optional<std::int64_t> SkipBookkeeping();

  // Moves to `begin`. The sequence ends when each log has reached `end`.
  void Go(const LogPosition& begin, const LogPosition& end);
  [[nodiscard]] LogPosition Position() const;  // of Head

  [[nodiscard]] LogPosition Begin() const { return LogPosition(lanes_.size(), 0); }
  [[nodiscard]] LogPosition End() const;
  // Finds the first event of each log that is not before `utime`, by bisection.
  [[nodiscard]] LogPosition Find(std::int64_t utime) const;

  // The damaged regions that were skipped so far. A region that was skipped twice counts once.
  struct DamageCount {
    std::int64_t regions = 0;
    std::int64_t bytes = 0;
    bool operator==(const DamageCount&) const = default;
  };
  [[nodiscard]] DamageCount damage() const;
  [[nodiscard]] std::vector<LogReader::Damage> damage_of(std::size_t log) const;  // in order

 private:
  struct Place {
    LogEvent event;
    std::size_t offset = 0;
  };
  struct Lane {
    Bytes log;
    LogReader reader;
    std::size_t body = 0;  // offset after the header events, whose times may be later than those of the messages
    std::size_t end = 0;
    std::optional<Place> head;
    std::optional<Place> following;             // the next event of the log, even beyond `end`
    std::int64_t utime = 0;                     // of the head
    std::size_t damage_seen = 0;                // regions of the reader that are in `damage`
    std::map<std::size_t, std::size_t> damage;  // offset, size
  };

  [[nodiscard]] static std::optional<Place> Read(Lane& lane);
  [[nodiscard]] static std::int64_t FirstTime(const Lane& lane);
  static void Begin(Lane& lane, std::size_t begin, std::size_t end);
  static void Advance(Lane& lane);
  // Returns true if the lane `one` comes after `other`. std::make_heap puts the greatest element first.
  [[nodiscard]] bool Later(std::size_t one, std::size_t other) const;

  std::vector<Lane> lanes_;
  std::vector<std::size_t> heap_;  // indices of the lanes that have a head
};

}  // namespace axlecast
