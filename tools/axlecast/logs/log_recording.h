#pragma once

#include <axlecast/recorder_health_t.hpp>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "platform/net/lcm_port.h"
#include "tools/recorder/recording_alarms.h"
#include "tools/recorder/recording_health.h"
#include "tools/recorder/recording_session.h"

namespace axlecast {

// One log of `axlecast record`: the recording, its health, and what an operator is told of it.
class LogRecording {
 public:
  LogRecording(RecordingSettings settings, const Clock& clock);

  // Goes on with the file where there is one. Empty, or why that cannot be.
  [[nodiscard]] std::string Continue(const std::string& file);
  // Empty when it listens and writes, else the cause and the remedy.
  [[nodiscard]] std::string Open() { return recording_.Open(); }

  void Start() { recording_.Start(); }
  void Stop() { recording_.Stop(); }

  // Publishes how it stands, and its alarms. `errors`: what has appeared or is over since the call before; each is told once.
  recorder_health_t Tell(LcmPort& port, bool stopping, std::vector<std::string>& errors);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::vector<std::string>& urls() const { return urls_; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return recording_.warnings(); }
  [[nodiscard]] RecordingStatus status() const { return recording_.status(); }
  [[nodiscard]] bool failed() const { return recording_.failed(); }
  [[nodiscard]] bool Reads() { return recording_.Reads(); }

 private:
  void TellErrors(const LogWriterStatus& disk, std::vector<std::string>& errors);

  std::string name_;
  std::vector<std::string> urls_;
  const Clock& clock_;
  std::int64_t boot_id_;
  RecordingHealth health_;
  RecordingAlarms alarms_;
  RecordingSession recording_;
  std::string told_;
  bool bad_ = false;
};

}  // namespace axlecast
