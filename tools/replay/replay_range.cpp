#include "tools/replay/replay_range.h"

#include <algorithm>

namespace axlecast {
namespace {

void Greatest(LogPosition& one, const LogPosition& other) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = std::max(one[i], other[i]);
}

void Least(LogPosition& one, const LogPosition& other) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = std::min(one[i], other[i]);
}

// Counts events from the logs' beginning.
class Walk {
 public:
  explicit Walk(LogMerge& logs) : logs_(logs) { logs.Go(logs.Begin(), logs.End()); }

  // The place of the event of this number, which is not before the one of the last call.
  [[nodiscard]] LogPosition To(std::int64_t event) {
    for (; number_ < event && logs_.Head() != nullptr; ++number_) logs_.Advance();
    return logs_.Position();
  }

 private:
  LogMerge& logs_;
  std::int64_t number_ = 0;
};

}  // namespace

ReplayRange FindRange(const std::vector<Bytes>& bytes, const ReplayWish& wish) {
  LogMerge logs(bytes);
  ReplayRange range{.begin = logs.Begin(), .end = logs.End()};
  range.end_utime = SpanOf(bytes).last;
  if (wish.from) Greatest(range.begin, logs.Find(*wish.from));
  if (wish.until) {
    range.end_utime = std::clamp(*wish.until, -kFarthestUtime, kFarthestUtime);
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
  range.begin_utime = logs.SkipBookkeeping().value_or(0);
  range.empty = logs.Head() == nullptr;
  return range;
}

}  // namespace axlecast
