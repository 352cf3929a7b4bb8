#include "tools/monitor/live_machine.h"

#include <algorithm>

namespace axlecast {

LiveMachine::LiveMachine(const MachineConfig& machine, const Clock& clock)
    : clock_(clock), port_(machine.lcm.url, machine.lcm.prefix, machine.machine), view_(machine) {
  const auto handler = [this](const std::string& channel, Bytes message) {
    view_.OnMessage(channel, message, clock_.Now());
  };
  if (!port_.problem().empty()) {
    state_ = Failure(port_.problem());
  } else if (!port_.Subscribe("(POSITION|MOTOR|LIMITS|DEVICE|ALARM|BUS|TIME)/.*", handler)) {
    state_ = Failure("cannot subscribe on " + machine.lcm.url);
  }
  view_.SetReceptionRemedy(port_.warning());
}

Result<> LiveMachine::GatherAll(const MachineConfig& machine) {
  // Bridge, mqtt and ship publish ALARM once a second, if they run, and so do the drivers of another machine its name.
  constexpr MonoNs kAlarmWait = 1200 * kMillisecond;
  const MonoNs start = clock_.Now();
  const bool has_broker = !machine.mqtt.host.empty();
  const bool has_fleet = !machine.ship.database.empty();
  return Gather(start + GatherTime(machine), [&](const MachineView& view) {
    const bool alarms = view.bridge().received() && (view.broker().received() || !has_broker) &&
                        (view.shipper().received() || !has_fleet);
    const auto others = port_.received().machines;
    const bool named = std::ranges::none_of(others, [](const OtherMachine& other) { return other.name.empty(); });
    return view.AllReceived() && ((alarms && named) || clock_.Now() - start > kAlarmWait);
  });
}

Result<> LiveMachine::Gather(MonoNs deadline, const std::function<bool(const MachineView&)>& enough) {
  constexpr MonoNs kLongestWait = 100 * kMillisecond;  // so that Tick is called often enough
  while (state_) {
    const MonoNs now = clock_.Now();
    view_.Tick(now);
    if (now >= deadline || enough(view_)) break;
    const MonoNs wait = std::min(deadline - now, kLongestWait);
    if (!port_.Handle(static_cast<int>((wait + kMillisecond - 1) / kMillisecond)))
      return Failure("the LCM port failed");
    view_.OnReception(port_.received());
  }
  return state_;
}

MonoNs GatherTime(const MachineConfig& machine) {
  const bool monitors =
      std::ranges::any_of(machine.buses, [](const BusConfig& bus) { return !bus.family->has_position; });
  return monitors ? 6 * kSecond : 2500 * kMillisecond;
}

Result<MachineView> Observe(const MachineConfig& machine, const Clock& clock, MonoNs timeout,
                            const std::function<bool(const MachineView&)>& enough) {
  LiveMachine live(machine, clock);
  if (const auto gathered = live.Gather(clock.Now() + timeout, enough); !gathered) return Failure(gathered.error());
  return live.view();
}

}  // namespace axlecast
