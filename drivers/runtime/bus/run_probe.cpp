#include "drivers/runtime/bus/run_probe.h"

#include <algorithm>

namespace axlecast {
namespace {

constexpr MonoNs kLook = 50 * kMillisecond;  // how soon a stop is noticed while nothing comes

// Nothing may lie unread when a request goes out.
const Event* Carry(const Step& step, Medium& medium, MonoNs now) {
  if (std::holds_alternative<Exchange>(step.action)) {
    if (const Event* stray = medium.FindStray()) return stray;
  }
  return medium.Run(step, now + kLook);
}

}  // namespace

bool RunProbe(Probe& probe, Medium& medium, const Clock& clock, const std::function<bool()>& stop) {
  while (!stop()) {
    const MonoNs now = clock.Now();
    const std::optional<Step> step = probe.Next(now);
    if (!step) return true;
    const Event* event = Carry(*step, medium, now);
    if (event == nullptr) continue;
    probe.On(*event);
    if (event->kind == Event::Kind::kLinkDown) return false;
  }
  return true;
}

}  // namespace axlecast
