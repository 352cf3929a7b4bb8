#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/config/machine_config.h"
#include "tools/replay/replay.h"
#include "tools/web/web_model.h"

namespace axlecast {

// A recorded machine, played for one browser.
class LogPlayer {
 public:
  // A seek reads from so long before its place on: DEVICE, BUS and ALARM come once a second, trips once a minute.
  static constexpr std::int64_t kLeadUs = 75'000'000;
  static constexpr std::int64_t kFirstLookUs = 2'500'000;
  // Messages that one Advance takes at most, so that the other browsers are served meanwhile.
  static constexpr int kMaxPerAdvance = 20'000;

  // The logs and `machine` outlive it. It is paused, so far behind the
  // log's start that all states have been told.
  LogPlayer(const std::vector<Bytes>& logs, const MachineConfig& machine, std::string version, WebLogFacts facts,
            MonoNs now);

  // Takes in what is due. True when a seek has come to its place: the scene is a new one.
  [[nodiscard]] bool Advance(MonoNs now);

  void Seek(std::int64_t utime, MonoNs now);
  void Play(bool play, MonoNs now);
  void SetSpeed(double speed, MonoNs now);

  [[nodiscard]] WebModel& scene() { return *scene_; }
  [[nodiscard]] WebPlayback Playback(MonoNs now) const;
  // The log's time.
  [[nodiscard]] WebTimestamp Now(MonoNs now) const;

 private:
  const std::vector<Bytes>& logs_;
  const MachineConfig& machine_;
  std::string version_;
  WebLogFacts facts_;
  Replay replay_;
  std::unique_ptr<WebModel> scene_;
  double speed_ = 1;
  bool playing_ = false;
  std::int64_t target_ = 0;
  bool seeking_ = false;
};

}  // namespace axlecast
