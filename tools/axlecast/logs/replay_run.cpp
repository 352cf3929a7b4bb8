#include "tools/axlecast/logs/replay_run.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <iostream>

#include "platform/os/terminal_output.h"
#include "platform/os/wait_until.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

// A timer wakes up late by some tens of us on many machines: the rest of the way is spun.
constexpr MonoNs kSpin = 80 * kMicrosecond;
constexpr int kMaxAtOnce = 256;  // messages, before keys and signals are looked at again
constexpr double kFastest = 1'024;
constexpr double kSlowest = 1.0 / 64;
constexpr const char* kClearLine = "\r\x1b[K";

}  // namespace

ReplayRun::ReplayRun(Replay& replay, const std::vector<MappedFile>& logs, LcmPort& data, LcmPort& commands,
                     bool shows)
    : replay_(replay), logs_(logs), data_(data), commands_(commands), shows_(shows) {
  // Without priority; it makes the timers exact. A kernel without that only wakes up later.
  static_cast<void>(ApplyRealtime(0, -1, false));
}

ReplayOutcome ReplayRun::Run() {
  const MonoNs begin = clock_.Now();
  std::string loss;
  while (!replay_.AtEnd() && !quit_ && !stop_.Requested() && loss.empty()) {
    Show();
    Wait();
    TakeKeys();
    loss = Loss();
    if (!quit_ && !stop_.Requested() && loss.empty()) PlayDue();
  }
  if (shows_) SteerTerminal(kClearLine);
  const auto us = [](MonoNs duration) { return static_cast<double>(duration) / kMicrosecond; };
  ReplayOutcome outcome{.stopped = !replay_.AtEnd(),
                        .loss = Loss(),
                        .unsent = data_.unsent() + commands_.unsent(),
                        .seconds = static_cast<double>(clock_.Now() - begin) / kSecond,
                        .late_max_us = us(late_.max())};
  if (late_.count() > 0) {
    outcome.late_p50_us = us(late_.Percentile(0.5));
    outcome.late_p99_us = us(late_.Percentile(0.99));
  }
  return outcome;
}

void ReplayRun::Wait() {
  const MonoNs due = replay_.Due();
  const MonoNs wake = due == kNever ? kNever : due - kSpin;
  std::array<pollfd, 2> sources = {pollfd{stop_.FileDescriptor(), POLLIN, 0},
                                   pollfd{terminal_.FileDescriptor(), POLLIN, 0}};
  const int ready = PollUntil(sources, shows_ ? std::min(wake, next_show_) : wake, clock_);
  if (ready == 0 && due != kNever && due - clock_.Now() <= kSpin) WaitUntil(due, clock_);
}

void ReplayRun::PlayDue() {
  for (int i = 0; i < kMaxAtOnce; ++i) {
    const MonoNs now = clock_.Now();
    if (replay_.Due() > now) return;
    const std::optional<Replay::Message> message = replay_.Take(now);
    if (!message) continue;
    late_.Add(now - message->due);
    (message->command ? commands_ : data_).Publish(*message->channel, message->data);
  }
}

void ReplayRun::TakeKeys() {
  for (const ReplayKey key : keys_.On(terminal_.Read())) Obey(key);
}

void ReplayRun::Obey(ReplayKey key) {
  const MonoNs now = clock_.Now();
  next_show_ = 0;
  switch (key) {
    case ReplayKey::kPause:
      return replay_.paused() ? replay_.Resume(now) : replay_.Pause(now);
    case ReplayKey::kStep:
      return replay_.Step(now);
    case ReplayKey::kBack1:
      return SeekBy(-1);
    case ReplayKey::kForward1:
      return SeekBy(1);
    case ReplayKey::kBack10:
      return SeekBy(-10);
    case ReplayKey::kForward10:
      return SeekBy(10);
    case ReplayKey::kFaster:
      return replay_.SetSpeed(std::min(replay_.speed() * 2, kFastest), now);
    case ReplayKey::kSlower:
      return replay_.SetSpeed(replay_.speed() == 0 ? 1 : std::max(replay_.speed() / 2, kSlowest), now);
    case ReplayKey::kQuit:
      quit_ = true;
      return;
  }
}

void ReplayRun::SeekBy(std::int64_t seconds) {
  const MonoNs now = clock_.Now();
  replay_.Seek(replay_.Utime(now) + seconds * 1'000'000, now);
}

std::string ReplayRun::Loss() const {
  std::string loss;
  for (auto log = logs_.begin(); log != logs_.end() && loss.empty(); ++log) loss = log->Loss();
  return loss;
}

void ReplayRun::Show() {
  const MonoNs now = clock_.Now();
  if (!shows_ || now < next_show_) return;
  SteerTerminal(kClearLine);
  std::cerr << ReplayProgress(replay_, now) << std::flush;
  next_show_ = now + kRedrawMs * kMillisecond;
}

}  // namespace axlecast
