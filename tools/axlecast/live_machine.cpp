#include "tools/axlecast/live_machine.h"

#include <algorithm>

namespace axlecast {

LiveMachine::LiveMachine(const MachineConfig& machine, const Clock& clock)
    : clock_(clock), port_(machine.lcm.url, machine.lcm.prefix), view_(machine), problem_(port_.problem()) {
  if (!problem_.empty()) return;
  const auto handler = [this](const std::string& channel, Bytes message) {
    view_.OnMessage(channel, message, clock_.Now());
  };
  if (!port_.Subscribe("(POSITION|MOTOR|DEVICE|ALARM|BUS)/.*", handler))
    problem_ = "cannot subscribe on " + machine.lcm.url;
}

bool LiveMachine::Gather(MonoNs deadline, const std::function<bool(const MachineView&)>& enough) {
  constexpr MonoNs kLongestWait = 100 * kMillisecond;  // so that Tick is called often enough
  for (;;) {
    const MonoNs now = clock_.Now();
    view_.Tick(now);
    if (now >= deadline || enough(view_)) return true;
    const MonoNs wait = std::min(deadline - now, kLongestWait);
    if (!port_.Handle(static_cast<int>((wait + kMillisecond - 1) / kMillisecond))) return false;
    view_.OnReception(port_.received());
  }
}

}  // namespace axlecast
