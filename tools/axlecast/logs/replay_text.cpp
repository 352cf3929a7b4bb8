#include "tools/axlecast/logs/replay_text.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "tools/axlecast/common/utc_text.h"

namespace axlecast {
namespace {

constexpr double kMicroseconds = 1e6;  // in a second
constexpr int kBar = 20;               // columns

std::string Number(const char* format, double value) {
  std::array<char, 64> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), format, value));
  return text.data();
}

std::string Speed(double speed) { return speed == 0 ? "fast" : Number("x%.4g", speed); }

std::string Bar(double share) {
  const int filled = std::clamp(static_cast<int>(share * kBar), 0, kBar);
  std::string bar(static_cast<std::size_t>(filled), '=');
  if (filled < kBar) bar += '>';
  bar.resize(kBar, ' ');
  return '[' + bar + ']';
}

}  // namespace

std::string ReplayProgress(const Replay& replay, MonoNs now) {
  const ReplayRange& range = replay.range();
  const std::int64_t utime = replay.Utime(now);
  const double done = static_cast<double>(utime - range.begin_utime) / kMicroseconds;
  const double length = static_cast<double>(range.end_utime - range.begin_utime) / kMicroseconds;
  std::string line = Bar(length > 0 ? done / length : 1) + Number(" %.1f", done) + Number("/%.1f s  ", length) +
                     UtcText(utime) + "  " + Speed(replay.speed()) + "  " + std::to_string(replay.counts().played);
  if (replay.paused()) line += "  paused";
  return line;
}

std::string ReplaySummary(const Replay& replay, const ReplayOutcome& outcome) {
  const Replay::Counts& counts = replay.counts();
  const LogMerge::DamageCount damage = replay.damage();
  std::string text = std::to_string(counts.played) + " messages played in " + Number("%.3f s", outcome.seconds);
  if (outcome.stopped) text += outcome.loss.empty() ? ", then stopped" : ", up to where the log was lost";
  if (counts.rounds > 1) text += ", " + std::to_string(counts.rounds) + " rounds";
  text += '\n';
  if (counts.held_back > 0) {
    text += "held back: " + std::to_string(counts.held_back) +
            " messages of command and permit channels; --allow-commands --yes-allow-commands plays them\n";
  }
  if (damage.regions > 0) {
    text += "skipped: " + std::to_string(damage.regions) + " damaged regions, " + std::to_string(damage.bytes) +
            " bytes that belong to no event\n";
  }
  if (!outcome.loss.empty()) text += outcome.loss + '\n';
  if (outcome.unsent > 0) {
    text += "not sent: " + std::to_string(outcome.unsent) +
            " messages; the network refused them, or their channel's name is longer than LCM's 63 characters\n";
  }
  if (counts.held_up > 0) {
    text += "held up: " + std::to_string(counts.held_up) +
            " times for more than 1 s (this machine is too busy, too slow for this speed, or the replay was "
            "suspended); what followed moved by as much\n";
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
