#include "tools/web/log_player.h"

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

constexpr Replay::Options kPaused = {.paused = true, .allow_commands = true};

// Returns a time of a log on both clocks. In a damaged log, it may be out of range.
WebTimestamp LogTime(std::int64_t utime) {
  constexpr std::int64_t kFarthest = INT64_MAX / kMicrosecond;
  return {.mono = std::clamp(utime, -kFarthest, kFarthest) * kMicrosecond, .utime = utime};
}

}  // namespace

LogPlayer::LogPlayer(const std::vector<Bytes>& logs, const MachineConfig& machine, std::string version,
                     WebLogFacts facts, MonoNs now)
    : logs_(logs),
      machine_(machine),
      version_(std::move(version)),
      facts_(std::move(facts)),
      replay_(logs_, FindRange(logs_, {}), ReplayChannels(), kPaused, now) {
  Seek(facts_.first_utime + kFirstLookUs, now);
}

void LogPlayer::Seek(std::int64_t utime, MonoNs now) {
  target_ = std::clamp(utime, facts_.first_utime, facts_.last_utime);
  seeking_ = true;
  model_ = std::make_unique<WebModel>(machine_, version_, facts_);
  replay_.SetSpeed(0, now);
  replay_.Resume(now);
  replay_.Seek(std::max(target_ - kLeadUs, facts_.first_utime), now);
}

bool LogPlayer::Advance(MonoNs now) {
  for (int i = 0; i < kMaxPerAdvance; ++i) {
    const bool reached = target_ < facts_.last_utime && replay_.Utime(now) >= target_;
    if (seeking_ && (reached || replay_.AtEnd())) {
      seeking_ = false;
      replay_.SetSpeed(speed_, now);
      if (!playing_) replay_.Pause(now);
      return true;
    }
    if (replay_.Due() > now) break;
    const auto message = replay_.Take(now);
    if (!message) continue;
    const WebTimestamp at = LogTime(message->utime);
    model_->OnMessage(*message->channel, message->data, at);
    model_->Tick(at.mono);
  }
  if (!seeking_ && replay_.AtEnd()) playing_ = false;
  return false;
}

void LogPlayer::Play(bool play, MonoNs now) {
  playing_ = play;
  if (seeking_) return;
  if (play && replay_.AtEnd()) return Seek(facts_.first_utime, now);
  if (play) {
    replay_.Resume(now);
  } else {
    replay_.Pause(now);
  }
}

void LogPlayer::SetSpeed(double speed, MonoNs now) {
  speed_ = speed;
  if (!seeking_) replay_.SetSpeed(speed, now);
}

WebPlayback LogPlayer::Playback(MonoNs now) const {
  return {.utime = Now(now).utime,
          .playing = playing_,
          .speed = speed_,
          .at_end = !seeking_ && replay_.AtEnd(),
          .seeking = seeking_};
}

WebTimestamp LogPlayer::Now(MonoNs now) const { return LogTime(seeking_ ? target_ : replay_.Utime(now)); }

}  // namespace axlecast
