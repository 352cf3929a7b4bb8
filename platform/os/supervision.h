#pragma once

#include <string>

#include "core/base/time.h"

namespace axlecast {

// Tells systemd how the process is (sd_notify). Without systemd all of it does nothing.
class Supervision {
 public:
  Supervision();

  void Ready();
  void Status(const std::string& text);  // one line for `systemctl status`
  void Stopping();

  // The loop that matters calls this each time it has got on. Feeds the watchdog, at most three times per
  // WatchdogSec; a loop that hangs does not call, and systemd restarts the process.
  void Progress(MonoNs now) {
    if (now >= next_ping_) Ping(now);
  }
  // Longest time between two calls of Progress that keeps the watchdog quiet; kNever without a watchdog.
  [[nodiscard]] MonoNs ping_interval() const { return interval_; }

 private:
  void Ping(MonoNs now);

  MonoNs interval_ = kNever;
  MonoNs next_ping_ = kNever;
};

}  // namespace axlecast
