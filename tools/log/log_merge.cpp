#include "tools/log/log_merge.h"

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <utility>

namespace axlecast {

LogMerge::LogMerge(std::vector<LogReader> readers) : readers_(std::move(readers)) {
  for (std::size_t log = 0; log < readers_.size(); ++log) Advance(log, INT64_MIN);
}

std::optional<LogMerge::Merged> LogMerge::Next() {
  if (heads_.empty()) return std::nullopt;
  std::ranges::pop_heap(heads_, Later);
  const Head head = heads_.back();
  heads_.pop_back();
  Advance(head.log, head.time);
  return Merged{head.event, head.log};
}

bool LogMerge::Later(const Head& one, const Head& other) {
  return std::tie(one.time, one.log) > std::tie(other.time, other.log);
}

void LogMerge::Advance(std::size_t log, std::int64_t since) {
  const std::optional<LogEvent> event = readers_[log].Next();
  if (!event) return;
  heads_.push_back({*event, log, std::max(since, event->utime)});
  std::ranges::push_heap(heads_, Later);
}

}  // namespace axlecast
