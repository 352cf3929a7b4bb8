#include "tools/replay/replay.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace axlecast {
namespace {

// ns, 146 years: limit for damaged times.
constexpr double kFarthest = 4.6e18;

void SetToMaximum(LogPosition& one, const LogPosition& other) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = std::max(one[i], other[i]);
}

void SetToMinimum(LogPosition& one, const LogPosition& other) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = std::min(one[i], other[i]);
}

// Counts events from the beginning of the logs.
class EventCounter {
 public:
  explicit EventCounter(LogMerge& logs) : logs_(logs) { logs.Go(logs.Begin(), logs.End()); }

  // Returns the position of the event with this number. It must not be before the event of the previous call.
  [[nodiscard]] LogPosition PositionOf(std::int64_t event) {
    for (; number_ < event && logs_.Head() != nullptr; ++number_) logs_.Advance();
    return logs_.Position();
  }

 private:
  LogMerge& logs_;
  std::int64_t number_ = 0;
};

// us. Times of one log run back a little if its recorder has several sources. If they run back further, its clock was set.
constexpr std::int64_t kClockSet = 1'000'000;
constexpr std::int64_t kShortestRound = 1'000;  // us; limits how often a log of one event is repeated
constexpr int kMaxSkipped = 100'000;            // events in one call

}  // namespace

void Timeline::Anchor(MonoNs now, std::int64_t utime) {
  anchor_ = now;
  anchor_utime_ = utime;
}

void Timeline::Splice(std::int64_t from, std::int64_t to) {
  if (!paused_) anchor_ = TimeOf(from);
  anchor_utime_ = to;
}

void Timeline::Pause(MonoNs now) {
  if (paused_) return;
  Anchor(now, Utime(now));
  paused_ = true;
}

void Timeline::Resume(MonoNs now) {
  if (!paused_) return;
  anchor_ = now;
  paused_ = false;
}

void Timeline::SetSpeed(double speed, MonoNs now) {
  Anchor(now, Utime(now));
  speed_ = speed;
}

MonoNs Timeline::TimeOf(std::int64_t utime) const {
  if (speed_ == 0) return anchor_;
  // The 53 bits of a double represent 100 days with a resolution of 1 ns, and a UNIX time with 1 us.
  const double us = static_cast<double>(utime) - static_cast<double>(anchor_utime_);
  const double ns = us * static_cast<double>(kMicrosecond) / speed_;
  return static_cast<MonoNs>(std::clamp(static_cast<double>(anchor_) + ns, -kFarthest, kFarthest));
}

std::int64_t Timeline::Utime(MonoNs now) const {
  if (paused_ || speed_ == 0) return anchor_utime_;
  const double us = static_cast<double>(now - anchor_) / static_cast<double>(kMicrosecond) * speed_;
  return static_cast<std::int64_t>(
      std::clamp(static_cast<double>(anchor_utime_) + std::round(us), -kFarthest, kFarthest));
}

ReplayRange FindRange(const std::vector<Bytes>& bytes, const ReplayRangeOptions& options) {
  LogMerge logs(bytes);
  ReplayRange range{.begin = logs.Begin(), .end = logs.End()};
  range.end_utime = SpanOf(bytes).last;
  if (options.from) SetToMaximum(range.begin, logs.Find(*options.from));
  if (options.until) {
    range.end_utime = std::clamp(*options.until, -kFarthestUtime, kFarthestUtime);
    SetToMinimum(range.end, logs.Find(range.end_utime));
  }
  EventCounter counter(logs);
  if (options.start_event > 0) SetToMaximum(range.begin, counter.PositionOf(options.start_event));
  if (options.end_event) {
    SetToMinimum(range.end, counter.PositionOf(*options.end_event));
    if (logs.Head() != nullptr) range.end_utime = std::min(range.end_utime, logs.HeadUtime());
  }
  SetToMaximum(range.end, range.begin);
  logs.Go(range.begin, range.end);
  range.begin_utime = logs.SkipBookkeeping().value_or(0);
  range.empty = logs.Head() == nullptr;
  return range;
}

Replay::Replay(const std::vector<Bytes>& logs, ReplayRange range, ReplayChannels channels, const Options& options,
               MonoNs now)
    : logs_(logs),
      range_(std::move(range)),
      channels_(std::move(channels)),
      options_(options),
      timeline_(options.speed) {
  timeline_.Anchor(now, range_.begin_utime);
  if (options.paused) timeline_.Pause(now);
  latest_ = range_.begin_utime;
  logs_.Go(range_.begin, range_.end);
  FindNext();
}

MonoNs Replay::Due() const {
  if (AtEnd()) return kNever;
  if (step_) return 0;
  if (timeline_.paused()) return kNever;
  if (timeline_.speed() == 0) return 0;
  return timeline_.Due(std::max(latest_, logs_.HeadUtime()));
}

std::optional<Replay::Message> Replay::Take(MonoNs now) {
  if (Due() > now) return std::nullopt;
  std::optional<Message> message;
  if (target_ != nullptr) message = TakeHead(now);
  SkipHead();
  FindNext();
  return message;
}

Replay::Message Replay::TakeHead(MonoNs now) {
  const LogEvent& event = *logs_.Head();
  const std::int64_t utime = std::max(latest_, logs_.HeadUtime());
  const bool at_once = step_ || timeline_.speed() == 0;
  const MonoNs due = at_once ? now : timeline_.Due(utime);
  if (!at_once && now - due > kHeldUp) {
    ++counts_.held_up;
    timeline_.Anchor(now, utime);
  }
  if (at_once) timeline_.Anchor(now, utime);
  step_ = false;
  ++counts_.played;
  counts_.bytes += static_cast<std::int64_t>(event.data.size());
  return {.channel = &target_->name,
          .data = event.data,
          .utime = event.utime,
          .due = due,
          .command = target_->command != CommandChannel::kNone};
}

bool Replay::SelectHead() {
  const LogEvent& event = *logs_.Head();
  const std::int64_t utime = logs_.HeadUtime();
  if (utime < latest_ - kClockSet) {
    timeline_.Splice(latest_, utime);
    latest_ = utime;
  }
  const ReplayChannels::Target& target = channels_.Of(event.channel);
  target_ = nullptr;
  if (!target.selected) {
    ++counts_.not_selected;
    return false;
  }
  const bool command = target.command == CommandChannel::kPlain ||
                       (target.command == CommandChannel::kAfterPrefix && IsCommandMessage(event.data));
  if (command && !options_.allow_commands) {
    ++counts_.held_back;
    return false;
  }
  target_ = &target;
  return true;
}

void Replay::SkipHead() {
  latest_ = std::max(latest_, logs_.HeadUtime());
  logs_.Advance();
}

void Replay::FindNext() {
  for (int skipped = 0; skipped < kMaxSkipped; ++skipped) {
    if (AtEnd()) EndRound();
    if (AtEnd() || SelectHead()) return;
    if (skipped + 1 < kMaxSkipped) SkipHead();
  }
}

void Replay::EndRound() {
  ++counts_.rounds;
  // If a round plays nothing, no further round would.
  if (!options_.loop || counts_.played == played_before_round_) return;
  played_before_round_ = counts_.played;
  const std::int64_t end = std::max({latest_, range_.end_utime, range_.begin_utime + kShortestRound});
  timeline_.Splice(end, range_.begin_utime);
  latest_ = range_.begin_utime;
  logs_.Go(range_.begin, range_.end);
}

void Replay::Pause(MonoNs now) { timeline_.Pause(now); }

void Replay::Resume(MonoNs now) { timeline_.Resume(now); }

void Replay::Step(MonoNs now) {
  timeline_.Pause(now);
  step_ = !AtEnd();
}

void Replay::SetSpeed(double speed, MonoNs now) { timeline_.SetSpeed(speed, now); }

void Replay::Seek(std::int64_t utime, MonoNs now) {
  const std::int64_t to = std::clamp(utime, range_.begin_utime, std::max(range_.begin_utime, range_.end_utime));
  LogPosition place = to <= range_.begin_utime ? range_.begin : logs_.Find(to);
  for (std::size_t i = 0; i < place.size(); ++i) place[i] = std::clamp(place[i], range_.begin[i], range_.end[i]);
  timeline_.Anchor(now, to);
  step_ = false;
  latest_ = to;
  logs_.Go(place, range_.end);
  FindNext();
}

std::int64_t Replay::Utime(MonoNs now) const {
  return std::clamp(timeline_.Utime(now), range_.begin_utime, std::max(range_.begin_utime, range_.end_utime));
}

}  // namespace axlecast
