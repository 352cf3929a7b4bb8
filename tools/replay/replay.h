#pragma once

#include <cstdint>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "tools/log/channel_filter.h"
#include "tools/log/log_merge.h"

namespace axlecast {

// Whether a receiver accepts a message on a channel of this name as a command, as a permit, or as an answer to one.
enum class CommandChannel {
  kNone,
  kAfterPrefix,  // only a machine whose prefix is the beginning of the name: depends on the type of the message
  kPlain,        // every machine without a prefix
};
[[nodiscard]] CommandChannel CommandChannelOf(std::string_view channel);

// Returns true if the message is a command, a permit, or an answer to one.
[[nodiscard]] bool IsCommandMessage(Bytes message);

// Selects the channels of a log that are replayed, and renames them. By default, every channel is replayed under its own name.
class ReplayChannels {
 public:
  struct Target {
    bool selected = false;
    std::string name;                                // name under which the channel is published
    CommandChannel command = CommandChannel::kNone;  // of that name
  };

  // Selects the channels that match the expression (ECMAScript). With `invert`: those that do not match.
  [[nodiscard]] Result<> Select(const std::string& expression, bool invert) {
    return filter_.Set(expression, invert);
  }
  // Adds the rule "OLD=NEW": each match of OLD (ECMAScript) in a name is replaced by NEW, which may contain $1 and $&. The first
  // '=' separates OLD and NEW. Several rules are applied in the order in which they were added.
  [[nodiscard]] Result<> Rename(const std::string& rule);
  // Sets the prefix of each name. It is added after all renaming.
  void Prefix(std::string prefix) { prefix_ = std::move(prefix); }

  // Returns the target of the channel. The reference is valid as long as this object.
  [[nodiscard]] const Target& Of(std::string_view channel);

 private:
  [[nodiscard]] Target MakeTarget(const std::string& channel);

  ChannelFilter filter_;
  std::vector<std::pair<std::regex, std::string>> renames_;
  std::string prefix_;

  struct Hash : std::hash<std::string_view> {
    using is_transparent = void;
  };
  std::unordered_map<std::string, Target, Hash, std::equal_to<>> targets_;
};

// Maps the time of a recording to the monotonic clock. All times are calculated from one anchor, so that rounding errors and late
// wake-ups do not accumulate.
class Timeline {
 public:
  // `speed` 0: as fast as possible; everything is due immediately.
  explicit Timeline(double speed) : speed_(speed) {}

  // Makes `utime` due at `now`.
  void Anchor(MonoNs now, std::int64_t utime);
  // Makes `to` due when `from` is: the clock of the recording was set, or the recording begins again.
  void Splice(std::int64_t from, std::int64_t to);

  void Pause(MonoNs now);
  void Resume(MonoNs now);
  void SetSpeed(double speed, MonoNs now);

  // Returns when `utime` is due; kNever while paused.
  [[nodiscard]] MonoNs Due(std::int64_t utime) const { return paused_ ? kNever : TimeOf(utime); }
  // Returns the time of the recording at `now`. While paused, or at speed 0: that of the anchor.
  [[nodiscard]] std::int64_t Utime(MonoNs now) const;

  [[nodiscard]] bool paused() const { return paused_; }
  [[nodiscard]] double speed() const { return speed_; }

 private:
  [[nodiscard]] MonoNs TimeOf(std::int64_t utime) const;

  double speed_;
  bool paused_ = false;
  MonoNs anchor_ = 0;
  std::int64_t anchor_utime_ = 0;
};

// The requested part of the logs.
struct ReplayRangeOptions {
  std::optional<std::int64_t> from = std::nullopt;   // us, UNIX time: begin with the first event that is not before
  std::optional<std::int64_t> until = std::nullopt;  // us, UNIX time: end before the first event that is not before
  std::int64_t start_event = 0;                      // begin with this event, counted from 0 over all logs
  std::optional<std::int64_t> end_event = std::nullopt;  // end before this event
};

// The part of the logs that is replayed.
struct ReplayRange {
  LogPosition begin;
  LogPosition end;
  std::int64_t begin_utime = 0;  // of the first event, or the requested time
  std::int64_t end_utime = 0;    // of the last event, or the requested time
  bool empty = true;             // contains no event
};

// Finds the requested part. Events of the logs themselves (IsLogChannel) are counted, but do not define its times.
[[nodiscard]] ReplayRange FindRange(const std::vector<Bytes>& logs, const ReplayRangeOptions& options);

// Calculates which message of event logs is due when. Has no clock and sends nothing: `now` is CLOCK_MONOTONIC, and the caller
// publishes. Messages come in the order of the logs, merged by time, with unchanged content, each once per round. Only Seek
// changes that order.
class Replay {
 public:
  struct Options {
    double speed = 1;  // 0: as fast as possible
    bool loop = false;
    bool paused = false;          // starts paused
    bool allow_commands = false;  // also replays command and permit channels
  };

  struct Message {
    const std::string* channel = nullptr;  // under which it is published
    Bytes data;
    std::int64_t utime = 0;  // of the event
    MonoNs due = 0;          // equals `now` if everything is due immediately
    bool command = false;    // true for a command or permit channel
  };

  struct Counts {
    std::int64_t played = 0;
    std::int64_t bytes = 0;         // data of the played messages
    std::int64_t not_selected = 0;  // other channels, and events of the logs themselves
    std::int64_t held_back = 0;     // commands and permits, which are not allowed
    std::int64_t rounds = 0;        // rounds that were completed
    std::int64_t held_up = 0;       // how often the player was late by more than kHeldUp
  };

  // If a message is later than this, because the player could not run or is too slow, all following messages are moved by the
  // delay. A burst of late messages would be worse.
  static constexpr MonoNs kHeldUp = kSecond;

  // `logs` must outlive this object. The time of the recording starts at `now`.
  Replay(const std::vector<Bytes>& logs, ReplayRange range, ReplayChannels channels, const Options& options,
         MonoNs now);

  // Returns when Take has a message. 0: immediately; kNever: paused, or at the end.
  [[nodiscard]] MonoNs Due() const;
  // Returns the next message if it is due. May return nothing although a message is due, if many events are skipped: call it again.
  [[nodiscard]] std::optional<Message> Take(MonoNs now);
  [[nodiscard]] bool AtEnd() const { return logs_.Head() == nullptr; }

  void Pause(MonoNs now) { timeline_.Pause(now); }
  void Resume(MonoNs now) { timeline_.Resume(now); }
  // Makes the next message due immediately, and pauses after it.
  void Step(MonoNs now);
  void SetSpeed(double speed, MonoNs now) { timeline_.SetSpeed(speed, now); }
  // Moves to the first event within the range that is not before `utime`.
  void Seek(std::int64_t utime, MonoNs now);

  // Returns the time of the recording that is being played, within the range.
  [[nodiscard]] std::int64_t Utime(MonoNs now) const;
  [[nodiscard]] const ReplayRange& range() const { return range_; }
  [[nodiscard]] bool paused() const { return timeline_.paused(); }
  [[nodiscard]] double speed() const { return timeline_.speed(); }
  [[nodiscard]] const Counts& counts() const { return counts_; }
  // Returns the damage of the parts that were read so far.
  [[nodiscard]] LogMerge::DamageCount damage() const { return logs_.damage(); }

 private:
  // Moves to the next event that is replayed. Skips a limited number of events, so that no call takes long.
  void FindNext();
  // Sets target_ for the event at the head. Returns false if the event is not replayed.
  [[nodiscard]] bool SelectHead();
  void SkipHead();
  void EndRound();
  [[nodiscard]] Message TakeHead(MonoNs now);

  LogMerge logs_;
  ReplayRange range_;
  ReplayChannels channels_;
  Options options_;
  Timeline timeline_;
  Counts counts_;
  const ReplayChannels::Target* target_ = nullptr;  // of the head; null if it is not replayed
  std::int64_t latest_ = 0;                         // latest time of an event so far: times may run back a little
  std::int64_t played_before_round_ = 0;
  bool step_ = false;
};

}  // namespace axlecast
