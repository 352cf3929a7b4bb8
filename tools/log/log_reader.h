#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tools/log/log_event.h"

namespace axlecast {

// Reads the events of a log and skips damage: after bytes that are not a record, it continues at the next plausible record. It
// finds every undamaged event, even if a damaged length before the event reaches beyond it. A record inside the data of another
// record is not an event of the log. The run time is proportional to the size of the log, for any content.
//
// Because there is no checksum, some damage is not detected: changed bytes of a number, a time, a channel or data, and a length
// that became smaller. In the last case the event is truncated, and the rest of it counts as damage.
class LogReader {
 public:
  // A range of bytes that does not belong to an event.
  struct Damage {
    std::size_t offset = 0;
    std::size_t size = 0;
    bool operator==(const Damage&) const = default;
  };

  // Starts at the offset `begin`. If no record begins there, it starts at the next record, and the bytes before that record do
  // not count as damage.
  explicit LogReader(Bytes log, std::size_t begin = 0);
  // Starts at `begin`, behind the event with the number `before`, so that damage at `begin` is skipped as anywhere else. `utime`: of
  // that event, if it is known.
  LogReader(Bytes log, std::size_t begin, std::int64_t before, std::optional<std::int64_t> utime);

  // Returns the next event, or nothing at the end. Its views refer to the log.
  [[nodiscard]] std::optional<LogEvent> Next();

  [[nodiscard]] std::size_t offset() const { return offset_; }  // of the last event that Next returned
  [[nodiscard]] std::size_t position() const {
    return position_;
  }  // after that event; at the end: the size of the log
  // Returns the damage so far, in order. A torn end of the log is the last range.
  [[nodiscard]] const std::vector<Damage>& damage() const { return damage_; }

 private:
  // An event whose number is confirmed by its neighbours.
  struct Anchor {
    std::int64_t number;
    std::size_t end;  // offset after its record
  };
  // A sequence of records without a gap between them.
  struct Chain {
    std::size_t last = 0;   // offset of the last record
    std::size_t links = 0;  // number of steps from the first to the last record
    bool to_end = false;    // it ends with the log
  };

  [[nodiscard]] std::optional<LogEvent> At(std::size_t offset) const;
  [[nodiscard]] std::size_t FindSync(std::size_t begin, std::size_t end) const;
  [[nodiscard]] bool IsPlausible(const LogEvent& event, std::size_t offset) const;
  [[nodiscard]] bool LeadsBehind(std::int64_t number, std::size_t offset) const;
  [[nodiscard]] bool BelongsToData(const LogEvent& event) const;
  [[nodiscard]] bool BelongsToLog(const LogEvent& event, std::size_t offset) const;
  [[nodiscard]] std::size_t FindNextRecord(std::size_t begin) const;
  [[nodiscard]] Chain Follow(const LogEvent& event, std::size_t offset, std::size_t limit);
  [[nodiscard]] std::optional<std::size_t> FindSwallowed(const LogEvent& event, std::size_t offset);
  [[nodiscard]] bool Disproves(const LogEvent& event, std::size_t offset, const LogEvent& inner,
                               std::size_t inner_offset, const Chain& chain) const;
  void Take(const LogEvent& event, std::size_t offset);

  Bytes log_;
  std::size_t offset_ = 0;
  std::size_t position_ = 0;
  std::vector<Damage> damage_;
  std::optional<Anchor> anchor_;
  std::optional<std::int64_t> utime_;  // of the previous event
  std::size_t links_ = 0;              // steps that Follow may still take: limits the work on a hostile log
};

// Returns the offset of the first event that is not before `utime`, by bisection: a few reads in a log of any size. Returns the
// size of the log if all events are before `utime`. Recorders write events in the order of their reception. If times run back by
// more than kSeekSlackUs, the result may be late by the same amount.
inline constexpr std::int64_t kSeekSlackUs = 200'000;
[[nodiscard]] std::size_t SeekTime(Bytes log, std::int64_t utime);

// The state in which a recorder continues an existing log, whose last record may be torn.
struct LogTail {
  std::size_t size = 0;          // of the log without a torn record at its end: truncate the file to this size
  std::int64_t next_number = 0;  // of the next event
  SealCount open;                // the records that no seal covers yet
  std::size_t torn = 0;          // bytes after `size`
};

// Many times the distance between two seals.
inline constexpr std::size_t kTailBytes = 4 * kLargestLogData;

// Reads the last `look` bytes of the log. If they contain no seal, reads the whole log.
[[nodiscard]] LogTail FindTail(Bytes log, std::size_t look = kTailBytes);

}  // namespace axlecast
