#include "platform/os/supervision.h"

#include <systemd/sd-daemon.h>

#include <cstdint>

namespace axlecast {

Supervision::Supervision() {
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0) {
    interval_ = static_cast<MonoNs>(watchdog_us) * kMicrosecond / 3;
    next_ping_ = 0;
  }
}

// A message that systemd does not take is lost: there is nobody else to tell, and the watchdog draws the
// conclusion.
void Supervision::Ready() { sd_notify(0, "READY=1"); }

void Supervision::Status(const std::string& text) { sd_notify(0, ("STATUS=" + text).c_str()); }

void Supervision::Stopping() { sd_notify(0, "STOPPING=1"); }

void Supervision::Ping(MonoNs now) {
  sd_notify(0, "WATCHDOG=1");
  next_ping_ = now + interval_;
}

}  // namespace axlecast
