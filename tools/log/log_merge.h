#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {

// us, 36,000 years. Times that damage made are bounded to this, so that sums and differences of them stay in range.
inline constexpr std::int64_t kFarthestUtime = INT64_MAX / 8;

// When the first and the last message of a log, or of several, were received: us, UNIX time; 0 without any.
struct LogSpan {
  std::int64_t first = 0;
  std::int64_t last = 0;
};

// Reads a few events at both ends. What a log holds of itself (IsLogChannel) does not count as its first message.
[[nodiscard]] LogSpan SpanOf(const std::vector<Bytes>& logs);

// A place in several logs: the offset of the next record in each.
using LogPosition = std::vector<std::size_t>;

// The events of one or several logs as one sequence, by time; of equal times the log's that was named first. The order
// within a log stays, also where its times run back.
class LogMerge {
 public:
  explicit LogMerge(const std::vector<Bytes>& logs);

  // The next event; its views live in its log. Nothing at the end. Valid until the place changes.
  [[nodiscard]] const LogEvent* Head() const {
    return heap_.empty() ? nullptr : &lanes_[heap_.front()].head->event;
  }
  [[nodiscard]] std::size_t HeadLog() const { return heap_.front(); }  // which one it is of
  // When the event happened: its own time, but where one event alone bears another than its neighbours (damage leaves
  // records with such), the nearest one of theirs. Bookkeeping of a log (IsLogChannel) is of the time of its neighbours.
  // Within 36,000 years of 1970.
  [[nodiscard]] std::int64_t HeadUtime() const { return lanes_[heap_.front()].utime; }
  void Advance();
  // Passes over bookkeeping; the time of the event behind it, nothing at the end.
  std::optional<std::int64_t> SkipBookkeeping();

  // Goes to `begin`; the end is where each log has reached `end`.
  void Go(const LogPosition& begin, const LogPosition& end);
  [[nodiscard]] LogPosition Position() const;  // of Head

  [[nodiscard]] LogPosition Begin() const { return LogPosition(lanes_.size(), 0); }
  [[nodiscard]] LogPosition End() const;
  // In each log the first event that is not before `utime`, found by bisection.
  [[nodiscard]] LogPosition Find(std::int64_t utime) const;

  // What was passed over so far because it is no event. What is passed twice counts once.
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
    std::size_t body = 0;  // behind the bookkeeping that it begins with, whose times may be later than the rest's
    std::size_t end = 0;
    std::optional<Place> head;
    std::optional<Place> following;             // the log's next one, also behind `end`
    std::int64_t utime = 0;                     // of the head
    std::size_t damage_seen = 0;                // of the reader's
    std::map<std::size_t, std::size_t> damage;  // offset, size
  };

  [[nodiscard]] static std::optional<Place> Read(Lane& lane);
  [[nodiscard]] static std::int64_t FirstTime(const Lane& lane);
  static void Begin(Lane& lane, std::size_t begin, std::size_t end);
  static void Advance(Lane& lane);
  // Whether `one` comes later than `other`: a heap has its largest in front.
  [[nodiscard]] bool Later(std::size_t one, std::size_t other) const;

  std::vector<Lane> lanes_;
  std::vector<std::size_t> heap_;  // of the lanes with a head
};

}  // namespace axlecast
