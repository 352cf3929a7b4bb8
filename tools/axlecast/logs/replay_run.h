#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/exchange_stats.h"
#include "core/base/inline_bytes.h"
#include "platform/net/lcm_port.h"
#include "platform/os/mapped_file.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal.h"
#include "tools/replay/replay.h"

namespace axlecast {

// The channels on which messages of a running machine come. Pure.
class LiveChannels {
 public:
  static constexpr std::size_t kMaxChannels = 1'000;  // anybody may invent more

  void On(const std::string& channel, Bytes message);

  [[nodiscard]] std::size_t size() const { return channels_.size(); }
  // The first few names and how many more there are, for people; empty when no message came.
  [[nodiscard]] std::string Text() const;

 private:
  std::set<std::string> channels_;
};

// Names of channels on which messages of a running machine came within about 1.2 s (every driver tells its state once a
// second), for people; empty when none came. A recorder's own messages do not count. Nothing when the URL cannot be heard;
// `problem` then says why.
[[nodiscard]] std::optional<std::string> HearLiveMachine(const std::string& url, std::string& problem);

// What a key of the keyboard means to a replay.
enum class ReplayKey {
  kPause,  // or goes on
  kStep,
  kBack1,  // s
  kForward1,
  kBack10,
  kForward10,
  kFaster,
  kSlower,
  kQuit,
};

// Tells keys from the bytes of a terminal (ECMA-48; xterm's arrows), however they are cut into reads. Pure.
class ReplayKeys {
 public:
  // The keys that are complete now; others than ours are passed over.
  [[nodiscard]] std::vector<ReplayKey> On(std::string_view bytes);

 private:
  std::string pending_;  // the beginning of a sequence
};

inline constexpr const char* kReplayKeysHelp =
    "space pause, s or . step, left/right 1 s, down/up 10 s, + - speed, q quit";

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

// Plays a replay on LCM, led by the keyboard where there is a terminal, until its end, the operator's, or a signal's.
class ReplayRun {
 public:
  // `logs`: what is replayed. `commands`: where command and permit channels go. With `shows` progress stands on standard
  // error.
  ReplayRun(Replay& replay, const std::vector<MappedFile>& logs, LcmPort& data, LcmPort& commands, bool shows);

  [[nodiscard]] ReplayOutcome Run();

 private:
  // Until something is due, or a key or a signal comes.
  void Wait();
  void PlayDue();
  void TakeKeys();
  void Obey(ReplayKey key);
  void SeekBy(std::int64_t seconds);
  void Show();
  // What is gone of the logs. Nothing is played any more then: messages could be zeros by now.
  [[nodiscard]] std::string Loss() const;

  Replay& replay_;
  const std::vector<MappedFile>& logs_;
  LcmPort& data_;
  LcmPort& commands_;
  bool shows_;
  SystemClock clock_;
  StopSignal stop_;
  TerminalKeys terminal_;
  ReplayKeys keys_;
  ExchangeStats late_;
  MonoNs next_show_ = 0;
  bool quit_ = false;
};

}  // namespace axlecast
