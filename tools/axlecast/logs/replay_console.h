#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "tools/replay/replay.h"

namespace axlecast {

// The channels on which messages of a running machine were received. Does no I/O.
class LiveChannels {
 public:
  static constexpr std::size_t kMaxChannels = 1'000;  // senders can invent any number of channels

  void On(const std::string& channel, Bytes message);

  [[nodiscard]] std::size_t size() const { return channels_.size(); }
  // Returns the first few names and the number of further ones, or an empty text.
  [[nodiscard]] std::string Text() const;

 private:
  std::set<std::string> channels_;
};

// The function of a key during a replay.
enum class ReplayKey {
  kPause,  // or resume
  kStep,
  kBack1,  // s
  kForward1,
  kBack10,
  kForward10,
  kFaster,
  kSlower,
  kQuit,
};

// Decodes keys from the bytes of a terminal (ECMA-48; arrows of xterm), which may be split at any byte. Does no I/O.
class ReplayKeys {
 public:
  // Returns the keys that are complete. Other keys are ignored.
  [[nodiscard]] std::vector<ReplayKey> On(std::string_view bytes);

 private:
  std::string pending_;  // the beginning of a sequence
};

inline constexpr const char* kReplayKeysHelp =
    "space pause, s or . step, left/right 1 s, down/up 10 s, + - speed, q quit";

// Returns the progress as one line for a terminal of 80 columns.
[[nodiscard]] std::string ReplayProgress(const Replay& replay, MonoNs now);

// The result of a replay.
struct ReplayOutcome {
  bool stopped = false;     // before the end, by the operator or because of `loss`
  std::string loss = {};    // the part of the logs that was lost during the replay (OpenedLog::Loss)
  std::int64_t unsent = 0;  // messages that LCM did not accept
  double seconds = 0;       // duration
  double late_p50_us = 0;   // time of publishing minus due time
  double late_p99_us = 0;
  double late_max_us = 0;
};

[[nodiscard]] std::string ReplaySummary(const Replay& replay, const ReplayOutcome& outcome);
[[nodiscard]] nlohmann::ordered_json ReplayJson(const Replay& replay, const ReplayOutcome& outcome);

}  // namespace axlecast
