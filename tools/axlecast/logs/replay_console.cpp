#include "tools/axlecast/logs/replay_console.h"

#include <algorithm>
#include <span>
#include <utility>

#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

constexpr std::size_t kNamed = 6;

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

std::string SpeedText(double speed) { return speed == 0 ? "fast" : Text("x%.4g", speed); }

std::string Bar(double share) {
  const int filled = std::clamp(static_cast<int>(share * kBar), 0, kBar);
  std::string bar(static_cast<std::size_t>(filled), '=');
  if (filled < kBar) bar += '>';
  bar.resize(kBar, ' ');
  return '[' + bar + ']';
}

}  // namespace

void LiveChannels::On(const std::string& channel, Bytes message) {
  if (channels_.size() >= kMaxChannels || channels_.contains(channel)) return;
  std::string type;
  if (DecodeToJson(message, &type) && type != "recorder_health_t") channels_.insert(channel);
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
                     " s  " + UtcText(utime) + "  " + SpeedText(replay.speed()) + "  " +
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

}  // namespace axlecast
