#include "tools/axlecast/logs/replay_run.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <span>
#include <utility>

#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

constexpr MonoNs kListen = 1'200 * kMillisecond;
constexpr int kSliceMs = 50;
constexpr std::size_t kNamed = 6;

bool IsOfMachine(Bytes message) {
  std::string type;
  return DecodeToJson(message, &type).has_value() && type != "recorder_health_t";
}

constexpr char kEscape = '\x1b';
constexpr char kEndOfTransmission = '\x04';  // Ctrl-D
constexpr std::size_t kLongestSequence = 32;

constexpr std::pair<char, ReplayKey> kPlainKeys[] = {
    {' ', ReplayKey::kPause},  {'s', ReplayKey::kStep},   {'.', ReplayKey::kStep},
    {'+', ReplayKey::kFaster}, {'=', ReplayKey::kFaster}, {'-', ReplayKey::kSlower},
    {'q', ReplayKey::kQuit},   {'Q', ReplayKey::kQuit},   {kEndOfTransmission, ReplayKey::kQuit}};
// By the last byte of their sequence.
constexpr std::pair<char, ReplayKey> kArrows[] = {
    {'A', ReplayKey::kForward10}, {'B', ReplayKey::kBack10}, {'C', ReplayKey::kForward1}, {'D', ReplayKey::kBack1}};

// Returns the size of the control sequence (CSI or SS3) at the beginning of `bytes`. 0: it is incomplete; 1: it is not one.
std::size_t SequenceSize(std::string_view bytes) {
  if (bytes.size() < 2) return 0;
  if (bytes[1] != '[' && bytes[1] != 'O') return 1;
  for (std::size_t i = 2; i < bytes.size(); ++i) {
    if (bytes[i] >= '@' && bytes[i] <= '~') return i + 1;
    if (bytes[i] < ' ' || bytes[i] > '~' || i > kLongestSequence) return i;
  }
  return 0;
}

constexpr double kMicroseconds = 1e6;  // in a second
constexpr int kBar = 20;               // columns

std::string Speed(double speed) { return speed == 0 ? "fast" : Text("x%.4g", speed); }

std::string Bar(double share) {
  const int filled = std::clamp(static_cast<int>(share * kBar), 0, kBar);
  std::string bar(static_cast<std::size_t>(filled), '=');
  if (filled < kBar) bar += '>';
  bar.resize(kBar, ' ');
  return '[' + bar + ']';
}

// On many machines, a timer is late by some tens of us: the remaining time is spun.
constexpr MonoNs kSpin = 80 * kMicrosecond;
constexpr int kMaxAtOnce = 256;  // messages between two checks of keys and signals
constexpr double kFastest = 1'024;
constexpr double kSlowest = 1.0 / 64;
constexpr const char* kClearLine = "\r\x1b[K";

}  // namespace

void LiveChannels::On(const std::string& channel, Bytes message) {
  if (channels_.size() >= kMaxChannels || channels_.contains(channel)) return;
  if (IsOfMachine(message)) channels_.insert(channel);
}

std::string LiveChannels::Text() const {
  std::string text;
  std::size_t named = 0;
  for (const std::string& channel : channels_) {
    if (++named > kNamed) return text + " and " + std::to_string(channels_.size() - kNamed) + " more";
    text += (named > 1 ? ", " : "") + Printable(channel);
  }
  return text;
}

Result<std::string> DetectLiveTraffic(const std::string& url) {
  LcmPort port(url, "");
  LiveChannels channels;
  const auto handler = [&channels](const std::string& channel, Bytes message) { channels.On(channel, message); };
  if (!port.problem().empty()) return Failure(port.problem());
  if (!port.Subscribe(".*", handler)) return Failure("cannot subscribe on " + url);
  const SystemClock clock;
  for (const MonoNs end = clock.Now() + kListen; clock.Now() < end;) {
    if (!port.Handle(kSliceMs)) return Failure("the LCM port failed: " + url);
  }
  return channels.Text();
}

std::vector<ReplayKey> ReplayKeys::On(std::string_view bytes) {
  pending_ += bytes;
  std::string_view rest = pending_;
  std::vector<ReplayKey> keys;
  while (!rest.empty()) {
    const std::size_t size = rest.front() == kEscape ? SequenceSize(rest) : 1;
    if (size == 0) break;
    std::span<const std::pair<char, ReplayKey>> table = kPlainKeys;
    if (size > 2) table = kArrows;
    const auto key = std::ranges::find(table, rest[size - 1], &std::pair<char, ReplayKey>::first);
    if (key != table.end()) keys.push_back(key->second);
    rest.remove_prefix(size);
  }
  pending_ = std::string(rest);
  return keys;
}

std::string ReplayProgress(const Replay& replay, MonoNs now) {
  const ReplayRange& range = replay.range();
  const std::int64_t utime = replay.Utime(now);
  const double done = static_cast<double>(utime - range.begin_utime) / kMicroseconds;
  const double length = static_cast<double>(range.end_utime - range.begin_utime) / kMicroseconds;
  std::string line = Bar(length > 0 ? done / length : 1) + ' ' + Decimal(done, 1) + '/' + Decimal(length, 1) +
                     " s  " + UtcText(utime) + "  " + Speed(replay.speed()) + "  " +
                     std::to_string(replay.counts().played);
  if (replay.paused()) line += "  paused";
  return line;
}

std::string ReplaySummary(const Replay& replay, const ReplayOutcome& outcome) {
  const Replay::Counts& counts = replay.counts();
  const LogMerge::DamageCount damage = replay.damage();
  std::string text = std::to_string(counts.played) + " messages played in " + Decimal(outcome.seconds, 3) + " s";
  if (outcome.stopped) text += outcome.loss.empty() ? ", then stopped" : ", up to where the log was lost";
  if (counts.rounds > 1) text += ", " + std::to_string(counts.rounds) + " rounds";
  text += '\n';
  if (counts.held_back > 0) {
    text += "held back: " + std::to_string(counts.held_back) +
            " messages of command and permit channels; --allow-commands --yes-allow-commands plays them\n";
  }
  if (damage.regions > 0) {
    text += "skipped: " + std::to_string(damage.regions) + " damaged regions, " + std::to_string(damage.bytes) +
            " bytes\n";
  }
  if (!outcome.loss.empty()) text += outcome.loss + '\n';
  if (outcome.unsent > 0) {
    text += "not sent: " + std::to_string(outcome.unsent) +
            " messages; the network refused them, or their channel's name is longer than LCM's 63 characters\n";
  }
  if (counts.held_up > 0) {
    text += "held up: " + std::to_string(counts.held_up) +
            " times for more than 1 s (this machine is too busy, too slow for this speed, or the replay was "
            "suspended); the following messages were delayed by the same time\n";
  }
  return text;
}

nlohmann::ordered_json ReplayJson(const Replay& replay, const ReplayOutcome& outcome) {
  const Replay::Counts& counts = replay.counts();
  const LogMerge::DamageCount damage = replay.damage();
  const char* const ended = !outcome.loss.empty() ? "lost" : outcome.stopped ? "stopped" : "end";
  return {{"ended", ended},
          {"played", counts.played},
          {"bytes", counts.bytes},
          {"not_selected", counts.not_selected},
          {"held_back", counts.held_back},
          {"damaged_regions", damage.regions},
          {"damaged_bytes", damage.bytes},
          {"unsent", outcome.unsent},
          {"rounds", counts.rounds},
          {"held_up", counts.held_up},
          {"seconds", outcome.seconds},
          {"begin_utime", replay.range().begin_utime},
          {"end_utime", replay.range().end_utime},
          {"late_p50_us", outcome.late_p50_us},
          {"late_p99_us", outcome.late_p99_us},
          {"late_max_us", outcome.late_max_us}};
}

ReplayRun::ReplayRun(Replay& replay, const LogFiles& logs, LcmPort& data, LcmPort& commands, bool shows)
    : replay_(replay), logs_(logs), data_(data), commands_(commands), shows_(shows) {
  // Sets no priority, only exact timers. If the kernel cannot do that, messages are sent a little later.
  static_cast<void>(ApplyRealtime(0, -1, false));
}

ReplayOutcome ReplayRun::Run() {
  const MonoNs begin = clock_.Now();
  std::string loss;
  while (!replay_.AtEnd() && !quit_ && !stop_.Requested() && loss.empty()) {
    Show();
    Wait();
    TakeKeys();
    loss = logs_.Loss();  // the content of further messages could be zeros
    if (!quit_ && !stop_.Requested() && loss.empty()) PlayDue();
  }
  if (shows_) SteerTerminal(kClearLine);
  const auto us = [](MonoNs duration) { return static_cast<double>(duration) / kMicrosecond; };
  ReplayOutcome outcome{.stopped = !replay_.AtEnd(),
                        .loss = logs_.Loss(),
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
  for (const ReplayKey key : keys_.On(terminal_.Read())) OnKey(key);
}

void ReplayRun::OnKey(ReplayKey key) {
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

void ReplayRun::Show() {
  const MonoNs now = clock_.Now();
  if (!shows_ || now < next_show_) return;
  SteerTerminal(kClearLine);
  std::cerr << ReplayProgress(replay_, now) << std::flush;
  next_show_ = now + kRedrawMs * kMillisecond;
}

}  // namespace axlecast
