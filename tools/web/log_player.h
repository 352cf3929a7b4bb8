#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/config/machine_config.h"
#include "tools/replay/replay.h"
#include "tools/web/web_model.h"

namespace axlecast {

// Plays the log of a machine for one browser.
class LogPlayer {
 public:
  // A seek begins to read this time before its target: states are sent once per second, trips once per minute.
  static constexpr std::int64_t kLeadUs = 75'000'000;
  static constexpr std::int64_t kFirstLookUs = 2'500'000;
  // Maximum messages per Advance, so that other browsers are served meanwhile.
  static constexpr int kMaxPerAdvance = 20'000;

  // `logs` and `machine` must outlive it. The player is paused at kFirstLookUs after the start of the log, where all
  // states are known.
  LogPlayer(const std::vector<Bytes>& logs, const MachineConfig& machine, std::string version, WebLogFacts facts,
            MonoNs now);

  // Processes due messages. Returns true if a seek has reached its target; the model is then a new one.
  [[nodiscard]] bool Advance(MonoNs now);

  void Seek(std::int64_t utime, MonoNs now);
  void Play(bool play, MonoNs now);
  void SetSpeed(double speed, MonoNs now);

  [[nodiscard]] WebModel& model() { return *model_; }
  [[nodiscard]] WebPlayback Playback(MonoNs now) const;
  // Returns the time in the log.
  [[nodiscard]] WebTimestamp Now(MonoNs now) const;

 private:
  const std::vector<Bytes>& logs_;
  const MachineConfig& machine_;
  std::string version_;
  WebLogFacts facts_;
  Replay replay_;
  std::unique_ptr<WebModel> model_;
  double speed_ = 1;
  bool playing_ = false;
  std::int64_t target_ = 0;
  bool seeking_ = false;
};

}  // namespace axlecast
