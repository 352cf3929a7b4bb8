#include "drivers/runtime/bus/run_probe.h"

#include <algorithm>

namespace axlecast {
namespace {

constexpr MonoNs kLook = 50 * kMillisecond;  // how soon a stop is noticed while nothing comes

constexpr std::size_t kTheProbe = 0;  // the guard's only device

// Nothing may lie unread when a request goes out, and no late reply may look like its reply.
const Event* Carry(const Step& step, Transactor& medium, StaleReplyGuard& guard, MonoNs now) {
  const auto* exchange = std::get_if<Exchange>(&step.action);
  if (exchange == nullptr) return medium.Run(step, now + kLook);
  if (const Event* stray = medium.FindStray()) return stray;
  const MonoNs free_at = guard.FreeAt(*exchange, now);
  if (free_at > now) return medium.Run(Step{.action = Idle{free_at}}, std::min(free_at, now + kLook));
  const Event* event = medium.Run(step, now + kLook);
  guard.Ended(*exchange, kTheProbe, *event);
  return event;
}

}  // namespace

bool RunProbe(Probe& probe, Transactor& medium, const Clock& clock, StaleReplyGuard& guard,
              const std::function<bool()>& stop) {
  while (!stop()) {
    const MonoNs now = clock.Now();
    const std::optional<Step> step = probe.Next(now);
    if (!step) return true;
    const Event* event = Carry(*step, medium, guard, now);
    if (event == nullptr) continue;
    if (event->kind == Event::Kind::kUnexpectedBytes && !event->early)
      guard.CameUnexpected(event->bytes, event->received.last);
    probe.On(*event);
    if (event->kind == Event::Kind::kLinkDown) return false;
  }
  return true;
}

}  // namespace axlecast
