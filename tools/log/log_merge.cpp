#include "tools/log/log_merge.h"

#include <algorithm>

namespace axlecast {
namespace {

constexpr std::size_t kTail = 64U << 10;  // bytes at the end that are searched first for the last event

std::int64_t Bounded(std::int64_t utime) { return std::clamp(utime, -kFarthestUtime, kFarthestUtime); }

std::optional<std::int64_t> LastUtimeOf(Bytes log) {
  for (std::size_t tail = kTail;; tail *= 4) {
    LogReader reader(log, log.size() - std::min(tail, log.size()));
    std::optional<std::int64_t> last;
    while (const std::optional<LogEvent> event = reader.Next()) last = Bounded(event->utime);
    if (last || tail >= log.size()) return last;
  }
}

std::size_t BodyOf(Bytes log) {
  LogReader reader(log);
  while (const std::optional<LogEvent> event = reader.Next()) {
    if (!IsLogChannel(event->channel)) return reader.offset();
  }
  return log.size();
}

}  // namespace

LogSpan SpanOf(const std::vector<Bytes>& logs) {
  LogMerge merge(logs);
  std::optional<std::int64_t> last;
  for (const Bytes log : logs) last = std::max(last, LastUtimeOf(log));  // an empty optional is less than any value
  return {.first = merge.SkipBookkeeping().value_or(0), .last = last.value_or(0)};
}

LogMerge::LogMerge(const std::vector<Bytes>& logs) {
  for (const Bytes log : logs) {
    lanes_.push_back(
        {.log = log, .reader = LogReader(log), .body = BodyOf(log), .head = {}, .following = {}, .damage = {}});
  }
  Go(Begin(), End());
}

std::optional<LogMerge::Place> LogMerge::Read(Lane& lane) {
  const std::optional<LogEvent> event = lane.reader.Next();
  const std::vector<LogReader::Damage>& damage = lane.reader.damage();
  for (; lane.damage_seen < damage.size(); ++lane.damage_seen) {
    const LogReader::Damage& region = damage[lane.damage_seen];
    if (region.offset < lane.end) lane.damage.emplace(region.offset, region.size);
  }
  if (!event) return std::nullopt;
  return Place{*event, lane.reader.offset()};
}

// The first event has no predecessor. Its time is wrong if it is later than both times that follow.
std::int64_t LogMerge::FirstTime(const Lane& lane) {
  if (!lane.following) return 0;
  LogReader ahead(lane.log, lane.following->offset);
  std::vector<std::int64_t> times;
  while (times.size() < 3) {
    const std::optional<LogEvent> event = ahead.Next();
    if (!event) break;
    if (!IsLogChannel(event->channel)) times.push_back(Bounded(event->utime));
  }
  if (times.size() < 3) return times.empty() ? 0 : times.front();
  return std::min(times[0], std::max(times[1], times[2]));
}

void LogMerge::Begin(Lane& lane, std::size_t begin, std::size_t end) {
  lane.reader = LogReader(lane.log, begin);
  lane.damage_seen = 0;
  lane.end = end;
  lane.following = Read(lane);
  lane.utime = FirstTime(lane);
  Advance(lane);
}

void LogMerge::Advance(Lane& lane) {
  lane.head = lane.following;
  if (lane.head && lane.head->offset >= lane.end) lane.head.reset();
  if (!lane.head) return;
  lane.following = Read(lane);
  if (IsLogChannel(lane.head->event.channel)) return;
  // The median of three: a single wrong time is never the median.
  const std::int64_t own = Bounded(lane.head->event.utime);
  const bool has_next = lane.following && !IsLogChannel(lane.following->event.channel);
  const std::int64_t next = has_next ? Bounded(lane.following->event.utime) : own;
  const auto [low, high] = std::minmax(lane.utime, next);
  lane.utime = std::clamp(own, low, high);
}

bool LogMerge::Later(std::size_t one, std::size_t other) const {
  const std::int64_t utime = lanes_[one].utime;
  const std::int64_t other_utime = lanes_[other].utime;
  return utime != other_utime ? utime > other_utime : one > other;
}

void LogMerge::Advance() {
  const auto later = [this](std::size_t one, std::size_t other) { return Later(one, other); };
  std::pop_heap(heap_.begin(), heap_.end(), later);
  Lane& lane = lanes_[heap_.back()];
  Advance(lane);
  if (lane.head) {
    std::push_heap(heap_.begin(), heap_.end(), later);
  } else {
    heap_.pop_back();
  }
}

std::optional<std::int64_t> LogMerge::SkipBookkeeping() {
  while (Head() != nullptr && IsLogChannel(Head()->channel)) Advance();
  return Head() == nullptr ? std::nullopt : std::optional(HeadUtime());
}

void LogMerge::Go(const LogPosition& begin, const LogPosition& end) {
  heap_.clear();
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    Begin(lanes_[i], begin[i], end[i]);
    if (lanes_[i].head) heap_.push_back(i);
  }
  std::make_heap(heap_.begin(), heap_.end(),
                 [this](std::size_t one, std::size_t other) { return Later(one, other); });
}

LogPosition LogMerge::Position() const {
  LogPosition position;
  for (const Lane& lane : lanes_) position.push_back(lane.head ? lane.head->offset : lane.end);
  return position;
}

LogPosition LogMerge::End() const {
  LogPosition end;
  for (const Lane& lane : lanes_) end.push_back(lane.log.size());
  return end;
}

LogPosition LogMerge::Find(std::int64_t utime) const {
  LogPosition position;
  for (const Lane& lane : lanes_) {
    position.push_back(lane.body + SeekTime(lane.log.subspan(lane.body), utime));
  }
  return position;
}

LogMerge::DamageCount LogMerge::damage() const {
  DamageCount count;
  for (const Lane& lane : lanes_) {
    for (const auto& [offset, size] : lane.damage) {
      ++count.regions;
      count.bytes += static_cast<std::int64_t>(size);
    }
  }
  return count;
}

std::vector<LogReader::Damage> LogMerge::damage_of(std::size_t log) const {
  std::vector<LogReader::Damage> regions;
  for (const auto& [offset, size] : lanes_[log].damage) regions.push_back({offset, size});
  return regions;
}

}  // namespace axlecast
