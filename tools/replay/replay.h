#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "tools/log/log_merge.h"
#include "tools/replay/replay_channels.h"

namespace axlecast {

// Which instant of the clock a recording's time falls on. Every instant is reckoned from one anchor, so that rounding
// and late wake-ups do not add up.
class Timeline {
 public:
  // 0: as fast as possible, everything is due at once.
  explicit Timeline(double speed) : speed_(speed) {}

  // From now on `utime` falls on `now`.
  void Anchor(MonoNs now, std::int64_t utime);
  // What comes next bears `to` where its predecessor bore `from`: the recording's clock was set, or begins anew. `to`
  // falls where `from` does.
  void Splice(std::int64_t from, std::int64_t to);

  void Pause(MonoNs now);
  void Resume(MonoNs now);
  void SetSpeed(double speed, MonoNs now);

  // When `utime` is due; kNever while paused.
  [[nodiscard]] MonoNs Due(std::int64_t utime) const { return paused_ ? kNever : Instant(utime); }
  // The recording's time that falls on `now`; while paused, or as fast as possible, that of the anchor.
  [[nodiscard]] std::int64_t Utime(MonoNs now) const;

  [[nodiscard]] bool paused() const { return paused_; }
  [[nodiscard]] double speed() const { return speed_; }

 private:
  [[nodiscard]] MonoNs Instant(std::int64_t utime) const;

  double speed_;
  bool paused_ = false;
  MonoNs anchor_ = 0;
  std::int64_t anchor_utime_ = 0;
};

// The part of the logs that is wished for.
struct ReplayWish {
  std::optional<std::int64_t> from = std::nullopt;   // us, UNIX time: from the first event that is not before it
  std::optional<std::int64_t> until = std::nullopt;  // likewise: up to the first event that is not before it
  std::int64_t start_event = 0;                      // from this event on, counted from 0 over all of the logs
  std::optional<std::int64_t> end_event = std::nullopt;  // up to this one, which is not played any more
};

// The part of the logs that is played.
struct ReplayRange {
  LogPosition begin;
  LogPosition end;
  std::int64_t begin_utime = 0;  // of the first event, or the time that was wished for
  std::int64_t end_utime = 0;    // likewise of the last one
  bool empty = true;             // not a single event
};

// Bookkeeping events (IsLogChannel) count, but do not begin the range's time.
[[nodiscard]] ReplayRange FindRange(const std::vector<Bytes>& logs, const ReplayWish& wish);

// Plays event logs: says which message is due when. It has no clock and sends nothing: `now` is CLOCK_MONOTONIC, and
// whoever asks publishes. Messages come in the order of the logs (merged by time), with their content, each once a round;
// nothing that is asked of it changes that, but a seek leads elsewhere.
class Replay {
 public:
  struct Options {
    double speed = 1;  // 0: as fast as possible
    bool loop = false;
    bool paused = false;          // begins so
    bool allow_commands = false;  // plays command and permit channels too
  };

  struct Message {
    const std::string* channel = nullptr;  // under which it is published
    Bytes data;
    std::int64_t utime = 0;  // of the event
    MonoNs due = 0;          // `now` where everything is due at once
    bool command = false;    // of a command or permit channel
  };

  struct Counts {
    std::int64_t played = 0;
    std::int64_t bytes = 0;         // of played messages' data
    std::int64_t not_selected = 0;  // other channels, and the logs' bookkeeping
    std::int64_t held_back = 0;     // commands and permits that are not allowed
    std::int64_t rounds = 0;        // that were played to their end
    std::int64_t held_up = 0;       // times that the player was more than kHeldUp late
  };

  // A message that is later than this because the player could not run, or does not come after, moves all that follow:
  // a burst of what was missed is worse.
  static constexpr MonoNs kHeldUp = kSecond;

  // The logs outlive it. Time starts at `now`.
  Replay(const std::vector<Bytes>& logs, ReplayRange range, ReplayChannels channels, const Options& options,
         MonoNs now);

  // When Take has something; 0: at once; kNever: paused, or at the end.
  [[nodiscard]] MonoNs Due() const;
  // The next message, when it is due. Nothing also where a long stretch holds nothing to play: ask again.
  [[nodiscard]] std::optional<Message> Take(MonoNs now);
  [[nodiscard]] bool AtEnd() const { return logs_.Head() == nullptr; }

  void Pause(MonoNs now);
  void Resume(MonoNs now);
  // Plays the next message at once and pauses behind it.
  void Step(MonoNs now);
  void SetSpeed(double speed, MonoNs now);
  // To the first event that is not before `utime`, within the range.
  void Seek(std::int64_t utime, MonoNs now);

  // The recording's time that is being played, within the range.
  [[nodiscard]] std::int64_t Utime(MonoNs now) const;
  [[nodiscard]] const ReplayRange& range() const { return range_; }
  [[nodiscard]] bool paused() const { return timeline_.paused(); }
  [[nodiscard]] double speed() const { return timeline_.speed(); }
  [[nodiscard]] const Counts& counts() const { return counts_; }
  // Of what was read so far.
  [[nodiscard]] LogMerge::DamageCount damage() const { return logs_.damage(); }

 private:
  // Passes over what is not played; stops after many, so that no call takes long.
  void Settle();
  // Decides about the event at the head. False when it is not to be played.
  [[nodiscard]] bool Judge();
  void PassHead();
  void EndRound();
  [[nodiscard]] Message TakeHead(MonoNs now);

  LogMerge logs_;
  ReplayRange range_;
  ReplayChannels channels_;
  Options options_;
  Timeline timeline_;
  Counts counts_;
  const ReplayChannels::Fate* fate_ = nullptr;  // of the head; nullptr when it is not played
  std::int64_t latest_ = 0;  // time of the newest event that was passed: times may run back a little
  std::int64_t played_before_round_ = 0;
  bool step_ = false;
};

}  // namespace axlecast
