#include "tools/replay/replay.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace axlecast {
namespace {

// 146 years: what a damaged time can ask for at most.
constexpr double kFarthest = 4.6e18;

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

// us. Times of one log run back a little where a recorder has several sources; by more, its clock was set.
constexpr std::int64_t kClockSet = 1'000'000;
constexpr std::int64_t kShortestRound =
    1'000;                           // us; a log of one event must not be played a million times a second
constexpr int kMaxPassed = 100'000;  // events at a time that are not played

}  // namespace

void Timeline::Anchor(MonoNs now, std::int64_t utime) {
  anchor_ = now;
  anchor_utime_ = utime;
}

void Timeline::Splice(std::int64_t from, std::int64_t to) {
  if (!paused_) anchor_ = Instant(from);
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

MonoNs Timeline::Instant(std::int64_t utime) const {
  if (speed_ == 0) return anchor_;
  // A double's 53 bits hold 100 days to 1 ns, and a UNIX time to 1 us.
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
  Settle();
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
  if (fate_ != nullptr) message = TakeHead(now);
  PassHead();
  Settle();
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
  return {.channel = &fate_->name,
          .data = event.data,
          .utime = event.utime,
          .due = due,
          .command = fate_->command != CommandChannel::kNone};
}

bool Replay::Judge() {
  const LogEvent& event = *logs_.Head();
  const std::int64_t utime = logs_.HeadUtime();
  if (utime < latest_ - kClockSet) {
    timeline_.Splice(latest_, utime);
    latest_ = utime;
  }
  const ReplayChannels::Fate& fate = channels_.Of(event.channel);
  fate_ = nullptr;
  if (!fate.selected) {
    ++counts_.not_selected;
    return false;
  }
  const bool command = fate.command == CommandChannel::kPlain ||
                       (fate.command == CommandChannel::kBehindPrefix && IsCommandMessage(event.data));
  if (command && !options_.allow_commands) {
    ++counts_.held_back;
    return false;
  }
  fate_ = &fate;
  return true;
}

void Replay::PassHead() {
  latest_ = std::max(latest_, logs_.HeadUtime());
  logs_.Advance();
}

void Replay::Settle() {
  for (int passed = 0; passed < kMaxPassed; ++passed) {
    if (AtEnd()) EndRound();
    if (AtEnd() || Judge()) return;
    if (passed + 1 < kMaxPassed) PassHead();
  }
}

void Replay::EndRound() {
  ++counts_.rounds;
  // A round that plays nothing would be followed by none that does.
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
  Settle();
}

std::int64_t Replay::Utime(MonoNs now) const {
  return std::clamp(timeline_.Utime(now), range_.begin_utime, std::max(range_.begin_utime, range_.end_utime));
}

}  // namespace axlecast
