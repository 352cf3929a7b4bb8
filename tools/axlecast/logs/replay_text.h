#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/replay/replay.h"

namespace axlecast {

// How a replay is told of.

// One line for a terminal of 80 columns.
[[nodiscard]] std::string ReplayProgress(const Replay& replay, MonoNs now);

// What came of it.
struct ReplayOutcome {
  bool stopped = false;     // before the end: by the operator, or because of `loss`
  std::string loss = {};    // what of the logs was gone when they were played (MappedFile::Loss)
  std::int64_t unsent = 0;  // messages that LCM did not take
  double seconds = 0;       // that it took
  double late_p50_us = 0;   // publishing less the instant that was due
  double late_p99_us = 0;
  double late_max_us = 0;
};

[[nodiscard]] std::string ReplaySummary(const Replay& replay, const ReplayOutcome& outcome);
[[nodiscard]] nlohmann::ordered_json ReplayJson(const Replay& replay, const ReplayOutcome& outcome);

}  // namespace axlecast
