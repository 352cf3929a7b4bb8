#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tools/log/log_event.h"

namespace axlecast {

// Walks over the events of a log that stands in memory (or is mapped), past damage: after bytes that are no record it
// goes on at the next one that can be believed. Every undamaged event is found, whatever stands around it: also where
// the length before it was damaged into one that reaches over it. A record in the data of another one is none of the
// log's. Takes time in proportion to the log, whatever it holds.
//
// Without checksums some damage looks whole: bytes of a number, a time, a channel or data, and a length that became
// smaller (the event then comes cut, and the rest of it counts as damage).
class LogReader {
 public:
  // Bytes that belong to no event.
  struct Damage {
    std::size_t offset = 0;
    std::size_t size = 0;
    bool operator==(const Damage&) const = default;
  };

  // `begin`: where to start, the offset of a record, or of anything: then at the next record, and what stands before
  // that one is no damage.
  explicit LogReader(Bytes log, std::size_t begin = 0);

  // The next event; its views live in the log. Nothing at the end.
  [[nodiscard]] std::optional<LogEvent> Next();

  [[nodiscard]] std::size_t offset() const { return offset_; }      // of the event that Next returned
  [[nodiscard]] std::size_t position() const { return position_; }  // behind it; at the end the log's size
  // So far, in order; a torn tail is the last one.
  [[nodiscard]] const std::vector<Damage>& damage() const { return damage_; }

 private:
  // An event whose number is known to be right.
  struct Anchor {
    std::int64_t number;
    std::size_t end;  // behind its record
  };
  // Where records follow each other without a gap.
  struct Chain {
    std::size_t last = 0;   // the last one's offset
    std::size_t links = 0;  // from the first to the last
    bool to_end = false;    // it ends with the log
  };

  [[nodiscard]] std::optional<LogEvent> At(std::size_t offset) const;
  [[nodiscard]] std::size_t FindSync(std::size_t begin, std::size_t end) const;
  [[nodiscard]] bool Plausible(const LogEvent& event, std::size_t offset) const;
  [[nodiscard]] bool LeadsBehind(std::int64_t number, std::size_t offset) const;
  [[nodiscard]] bool Foreign(const LogEvent& event) const;
  [[nodiscard]] bool Believed(const LogEvent& event, std::size_t offset) const;
  [[nodiscard]] std::size_t Resume(std::size_t begin) const;
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
  std::optional<std::int64_t> utime_;  // of the event before
  std::size_t links_ = 0;              // that Follow may still take: bounds the work on a hostile log
};

// The offset of the first event whose utime is not before `utime`, by bisection: a few reads in a log of any size.
// Recorders write events in the order of their reception; where times run back by more than kSeekSlackUs, the answer may
// be late by as much. The log's size when all are before.
inline constexpr std::int64_t kSeekSlackUs = 200'000;
[[nodiscard]] std::size_t SeekTime(Bytes log, std::int64_t utime);

}  // namespace axlecast
