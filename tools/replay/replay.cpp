#include "tools/replay/replay.h"

#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/permit_t.hpp>
#include <cmath>
#include <utility>

#include "core/base/expression.h"
#include "core/base/result.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr std::array<std::string_view, 2> kWhole = {"COMMAND", "COMMAND_STATUS"};
constexpr std::array<std::string_view, 3> kFamilies = {"PERMIT/", "DRIVER_COMMAND/", "DRIVER_STATUS/"};

CommandChannel ChannelAt(std::size_t place) {
  if (place == std::string_view::npos) return CommandChannel::kNone;
  return place == 0 ? CommandChannel::kPlain : CommandChannel::kAfterPrefix;
}

// ns, 146 years: limit for damaged times.
constexpr double kFarthest = 4.6e18;

void SetToMaximum(LogPosition& one, const LogPosition& other) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = std::max(one[i], other[i]);
}

void SetToMinimum(LogPosition& one, const LogPosition& other) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = std::min(one[i], other[i]);
}

// us. Times of one log run back a little if its recorder has several sources. If they run back further, its clock was set.
constexpr std::int64_t kClockSet = 1'000'000;
constexpr std::int64_t kShortestRound = 1'000;  // us; limits how often a log of one event is repeated
constexpr int kMaxSkipped = 100'000;            // events in one call

}  // namespace

CommandChannel CommandChannelOf(std::string_view channel) {
  CommandChannel result = CommandChannel::kNone;
  for (const std::string_view name : kWhole) {
    if (channel.ends_with(name)) result = std::max(result, ChannelAt(channel.size() - name.size()));
  }
  for (const std::string_view name : kFamilies) result = std::max(result, ChannelAt(channel.find(name)));
  return result;
}

bool IsCommandMessage(Bytes message) {
  static const std::array<std::int64_t, 5> kTypes = {command_t::getHash(), command_status_t::getHash(),
                                                     permit_t::getHash(), driver_command_t::getHash(),
                                                     driver_status_t::getHash()};
  if (message.size() < 8) return false;
  const auto type = static_cast<std::int64_t>(ReadBigEndian<std::uint64_t>(message, 0));
  return std::find(kTypes.begin(), kTypes.end(), type) != kTypes.end();
}

Result<> ReplayChannels::Rename(const std::string& rule) {
  const std::size_t divide = rule.find('=');
  if (divide == std::string::npos || divide == 0) {
    return Failure("'" + rule + "' is not OLD=NEW, e.g. '^POSITION/=RECORDED/POSITION/'");
  }
  Result<std::regex> compiled = CompileExpression(rule.substr(0, divide));
  if (!compiled) return Failure(compiled.error());
  renames_.emplace_back(std::move(*compiled), rule.substr(divide + 1));
  return {};
}

const ReplayChannels::Target& ReplayChannels::Of(std::string_view channel) {
  if (const auto known = targets_.find(channel); known != targets_.end()) return known->second;
  const std::string name(channel);
  Target target;
  try {
    target = MakeTarget(name);
  } catch (const std::regex_error&) {
    // The expression is too complex for this name: the channel is not selected.
  }
  return targets_.emplace(name, std::move(target)).first->second;
}

ReplayChannels::Target ReplayChannels::MakeTarget(const std::string& channel) {
  if (IsLogChannel(channel) || !filter_.Matches(channel)) return {};
  Target target{.selected = true, .name = channel, .command = CommandChannel::kNone};
  for (const auto& [old_name, new_name] : renames_)
    target.name = std::regex_replace(target.name, old_name, new_name);
  target.name.insert(0, prefix_);
  target.command = CommandChannelOf(target.name);
  return target;
}

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
  logs.Go(logs.Begin(), logs.End());
  std::int64_t number = 0;  // of the event at the head
  const auto position_of = [&](std::int64_t event) {
    for (; number < event && logs.Head() != nullptr; ++number) logs.Advance();
    return logs.Position();
  };
  if (options.start_event > 0) SetToMaximum(range.begin, position_of(options.start_event));
  if (options.end_event) {
    SetToMinimum(range.end, position_of(*options.end_event));
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

void Replay::Step(MonoNs now) {
  timeline_.Pause(now);
  step_ = !AtEnd();
}

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
