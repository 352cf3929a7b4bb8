#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tools/log/log_event.h"

namespace axlecast {

// Walks over the events of a log that stands in memory (or is mapped), past damage: after bytes that are no record it
// goes on at the next one that can be believed: a whole record that is followed by another, or by the log's end. Every
// undamaged event is found, whatever stands around it.
class LogReader {
 public:
  // Bytes that belong to no event.
  struct Damage {
    std::size_t offset = 0;
    std::size_t size = 0;
    bool operator==(const Damage&) const = default;
  };

  // `begin`: where to start, the offset of a record, or of anything: then at the next record.
  explicit LogReader(Bytes log, std::size_t begin = 0);

  // The next event; its views live in the log. Nothing at the end.
  [[nodiscard]] std::optional<LogEvent> Next();

  [[nodiscard]] std::size_t offset() const;                 // of the event that Next returned
  [[nodiscard]] std::size_t position() const;               // behind it
  [[nodiscard]] const std::vector<Damage>& damage() const;  // so far, in order; a torn tail is the last one

 private:
  Bytes log_;
  std::size_t offset_ = 0;
  std::size_t position_ = 0;
  std::vector<Damage> damage_;
};

// The offset of the first event whose utime is not before `utime`, by bisection: a few reads in a log of any size.
// Recorders write events in the order of their reception; where times run back a little, the answer is early by as much.
// The log's size when all are before.
[[nodiscard]] std::size_t SeekTime(Bytes log, std::int64_t utime);

}  // namespace axlecast
