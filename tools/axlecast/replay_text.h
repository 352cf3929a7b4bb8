#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "tools/replay/replay.h"

namespace axlecast {

// How a replay is asked for and told of.

// A time of a log: seconds from its first event ("12.5"), before its last one ("-10"), the same with a unit ("90s",
// "15m", "2h"), or UTC ("2026-11-21T07:00:05", "2026-11-21 07:00:05.25"). Nothing when it is none of these.
[[nodiscard]] std::optional<ReplayTime> ParseReplayTime(std::string_view text);

// One line for a terminal of 80 columns.
[[nodiscard]] std::string ReplayProgress(const Replay& replay, MonoNs now);

// What came of it.
struct ReplayOutcome {
  bool stopped = false;     // by the operator, before the end
  std::int64_t unsent = 0;  // messages that LCM did not take
  double seconds = 0;       // that it took
  double late_p50_us = 0;   // publishing less the instant that was due
  double late_p99_us = 0;
  double late_max_us = 0;
};

[[nodiscard]] std::string ReplaySummary(const Replay& replay, const ReplayOutcome& outcome);
[[nodiscard]] nlohmann::ordered_json ReplayJson(const Replay& replay, const ReplayOutcome& outcome);

}  // namespace axlecast
