#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tools/log/log_reader.h"

namespace axlecast {

// The events of several logs as one sequence, by time; of equal times the earlier log's first. The order within a log
// stays, also where its times run back.
class LogMerge {
 public:
  explicit LogMerge(std::vector<LogReader> readers);

  struct Merged {
    LogEvent event;
    std::size_t log = 0;  // which one it is of
  };
  [[nodiscard]] std::optional<Merged> Next();

  [[nodiscard]] const std::vector<LogReader>& readers() const { return readers_; }

 private:
  struct Head {
    LogEvent event;
    std::size_t log;
    std::int64_t time;  // not before that of an earlier one of its log
  };
  static bool Later(const Head& one, const Head& other);
  void Advance(std::size_t log, std::int64_t since);

  std::vector<LogReader> readers_;
  std::vector<Head> heads_;  // a heap: the next one in front
};

}  // namespace axlecast
