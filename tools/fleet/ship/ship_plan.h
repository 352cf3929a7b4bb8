#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "core/base/time.h"

namespace axlecast {

// Limits the bytes per second. A piece of any size may be taken once the bucket is not empty; the bucket then owes what was taken
// beyond its content, so that the average is kept. Time is an argument.
class TokenBucket {
 public:
  // `rate`: bytes per second; 0: no limit. The bucket holds the bytes of one second.
  explicit TokenBucket(std::int64_t rate) : rate_(rate), tokens_(rate) {}

  // Returns when the next piece may be taken: `now` or later.
  [[nodiscard]] MonoNs NextAt(MonoNs now);
  void Take(std::int64_t bytes, MonoNs now);

 private:
  void Fill(MonoNs now);

  std::int64_t rate_;
  std::int64_t tokens_;  // may be negative
  MonoNs filled_ = std::numeric_limits<MonoNs>::min();
};

// A log that waits, as far as the order of the logs regards it.
struct WaitingLog {
  std::int64_t start_utime = 0;  // us, UNIX time
  bool live = false;             // a recorder writes to it
  std::int64_t waiting = 0;      // bytes that are not in the database
  bool more = false;             // its last batch was full: the next one is due
  MonoNs shipped_at = 0;         // end of its last batch
};

// Decides which log the next batch is from.
//
// - A log that is being written goes first, at most once in kLiveInterval, so that current data is in the database within 2 s.
//   Such a log is not limited: data older than its own waits for nothing.
// - In the time between, the other logs follow: the newest or the oldest first, at the bandwidth of the configuration.
class ShipPlan {
 public:
  static constexpr MonoNs kLiveInterval = 500 * kMillisecond;

  ShipPlan(bool newest_first, std::int64_t bandwidth) : newest_first_(newest_first), bucket_(bandwidth) {}

  // Returns the index of the log, or nothing if none is due.
  [[nodiscard]] std::optional<std::size_t> Next(std::span<const WaitingLog> logs, MonoNs now);
  // Returns when Next should be called if it has returned nothing; kNever if nothing waits.
  [[nodiscard]] MonoNs NextAt(std::span<const WaitingLog> logs, MonoNs now);
  // Counts the bytes of a batch.
  void Shipped(const WaitingLog& log, std::int64_t bytes, MonoNs now);

 private:
  [[nodiscard]] bool IsBefore(const WaitingLog& one, const WaitingLog& other) const;

  bool newest_first_;
  TokenBucket bucket_;
};

}  // namespace axlecast
