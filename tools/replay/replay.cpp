#include "tools/replay/replay.h"

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

// us. Times of one log run back a little where a recorder has several sources; by more, its clock was set.
constexpr std::int64_t kClockSet = 1'000'000;
constexpr std::int64_t kShortestRound =
    1'000;                           // us; a log of one event must not be played a million times a second
constexpr int kMaxPassed = 100'000;  // events at a time that are not played

}  // namespace

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
