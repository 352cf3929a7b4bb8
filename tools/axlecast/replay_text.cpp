#include "tools/axlecast/replay_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "tools/axlecast/utc_text.h"

namespace axlecast {
namespace {

constexpr double kMicroseconds = 1e6;  // in a second
constexpr int kBar = 20;               // columns

// Seconds as us; nothing when `text` is no number, or one beyond all logs.
std::optional<std::int64_t> ParseSeconds(std::string_view text) {
  double seconds = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), seconds, std::chars_format::fixed);
  if (error != std::errc() || end != text.data() + text.size() || !(std::abs(seconds) < 1e11)) return std::nullopt;
  return std::llround(seconds * kMicroseconds);
}

// "15m": ends in a unit of time.
bool IsAge(std::string_view text) {
  return !text.empty() && std::string_view("smhdw").find(text.back()) != text.npos;
}

// A fraction of a second, ".25", at the end of a time of day: us; taken off.
std::int64_t TakeFraction(std::string_view& text) {
  const bool zulu = text.ends_with('Z');
  const std::string_view body = text.substr(0, text.size() - (zulu ? 1 : 0));
  const std::size_t point = body.rfind('.');
  if (point == std::string_view::npos || point < 6 || body[point - 3] != ':' || body[point - 6] != ':') return 0;
  const auto fraction = ParseSeconds(body.substr(point));
  if (!fraction || *fraction < 0) return 0;
  text = text.substr(0, point);
  return *fraction;
}

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

std::optional<ReplayTime> ParseReplayTime(std::string_view text) {
  if (const auto us = ParseSeconds(text)) {
    return ReplayTime{false, text.starts_with('-') ? std::min<std::int64_t>(*us, -1) : *us};
  }
  const bool before_end = text.starts_with('-');
  if (IsAge(text)) {
    // Counted back from 0 it is negative.
    const auto age = ParseUtc(before_end ? text.substr(1) : text, 0);
    if (!age) return std::nullopt;
    return ReplayTime{false, before_end ? std::min<std::int64_t>(*age, -1) : -*age};
  }
  const std::int64_t fraction = TakeFraction(text);
  const auto utime = ParseUtc(text, 0);
  if (!utime || before_end) return std::nullopt;
  return ReplayTime{true, *utime + fraction};
}

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
  const MergedLogs::DamageCount damage = replay.damage();
  std::string text = std::to_string(counts.played) + " messages played in " + Number("%.3f s", outcome.seconds);
  if (outcome.stopped) text += ", then stopped";
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
  const MergedLogs::DamageCount damage = replay.damage();
  return {{"ended", outcome.stopped ? "stopped" : "end"},
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
