#include "tools/replay/replay_range.h"

#include <algorithm>

#include "tools/log/log_header.h"

namespace axlecast {
namespace {

constexpr std::int64_t kFarthest = INT64_MAX / 8;  // us, as MergedLogs bounds its times

void Greatest(LogPosition& one, const LogPosition& other) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = std::max(one[i], other[i]);
}

void Least(LogPosition& one, const LogPosition& other) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = std::min(one[i], other[i]);
}

std::int64_t FirstUtime(MergedLogs& logs) {
  while (logs.Head() != nullptr && IsLogChannel(logs.Head()->channel)) logs.Advance();
  return logs.Head() == nullptr ? 0 : logs.HeadUtime();
}

// Reckons what the user named from the logs' bounds.
class Times {
 public:
  explicit Times(MergedLogs& logs) : first_(FirstUtime(logs)), last_(logs.LastUtime()) {}

  [[nodiscard]] std::int64_t Of(const ReplayTime& time) const {
    const std::int64_t us = std::clamp(time.us, -kFarthest, kFarthest);
    if (time.unix_time) return us;
    return us < 0 ? last_ + us : first_ + us;
  }
  [[nodiscard]] std::int64_t last() const { return last_; }

 private:
  std::int64_t first_;
  std::int64_t last_;
};

// Counts events from the logs' beginning.
class Walk {
 public:
  explicit Walk(MergedLogs& logs) : logs_(logs) { logs.Go(logs.Begin(), logs.End()); }

  // The place of the event of this number, which is not before the one of the last call.
  [[nodiscard]] LogPosition To(std::int64_t event) {
    for (; number_ < event && logs_.Head() != nullptr; ++number_) logs_.Advance();
    return logs_.Position();
  }

 private:
  MergedLogs& logs_;
  std::int64_t number_ = 0;
};

}  // namespace

ReplayRange FindRange(const std::vector<Bytes>& bytes, const ReplayWish& wish) {
  MergedLogs logs(bytes);
  ReplayRange range{.begin = logs.Begin(), .end = logs.End()};
  const Times times(logs);
  range.end_utime = times.last();
  if (wish.from) Greatest(range.begin, logs.Find(times.Of(*wish.from)));
  if (wish.to) {
    range.end_utime = times.Of(*wish.to);
    Least(range.end, logs.Find(range.end_utime));
  }
  Walk walk(logs);
  if (wish.start_event > 0) Greatest(range.begin, walk.To(wish.start_event));
  if (wish.end_event) {
    Least(range.end, walk.To(*wish.end_event));
    if (logs.Head() != nullptr) range.end_utime = std::min(range.end_utime, logs.HeadUtime());
  }
  Greatest(range.end, range.begin);
  logs.Go(range.begin, range.end);
  range.begin_utime = FirstUtime(logs);
  range.empty = logs.Head() == nullptr;
  return range;
}

}  // namespace axlecast
