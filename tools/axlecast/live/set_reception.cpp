#include "tools/axlecast/live/set_reception.h"

#include <algorithm>
#include <axlecast/position_t.hpp>
#include <axlecast/time_quality_t.hpp>
#include <set>
#include <utility>

#include "core/config/hosts.h"
#include "core/config/ticks.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"

namespace axlecast {

PositionSetBuilder::Options SetOptionsOf(const MachineConfig& machine, const SetConfig& set, const TimeBase& time) {
  PositionSetBuilder::Options options;
  std::set<const HostConfig*> hosts;
  options.name = set.name;
  options.period_ns = set.period;
  options.limit_ns = set.limit;
  options.machine_id = NameHash(machine.machine);
  if (!machine.time.root.empty()) options.time = &time;
  for (const std::string& axis : set.axes) {
    const BusConfig& bus = *machine.BusOf(axis);
    hosts.insert(HostOfBus(machine.hosts, bus.name));
    options.phase_ns = TicksOf(bus).phase;
    options.axes.push_back({.device = axis, .ticks = TicksPerMessage(bus, *machine.FindDevice(axis))});
  }
  options.one_host = hosts.size() == 1;
  return options;
}

SetReception::SetReception(const MachineConfig& machine, std::vector<SetConfig> sets, const Clock& clock)
    : sets_(std::move(sets)),
      clock_(clock),
      port_(machine.lcm.url, machine.lcm.prefix, machine.machine),
      time_(NameHash(machine.machine)) {
  for (const SetConfig& set : sets_) builders_.emplace_back(SetOptionsOf(machine, set, time_));
}

Result<> SetReception::Open(Take take) {
  if (!port_.problem().empty()) return Failure(port_.problem());
  take_ = std::move(take);
  // First, so that a TIME message is known before a position that arrived after it.
  bool subscribed = port_.Subscribe("TIME/.*", [this](const std::string&, Bytes message) {
    if (const auto time = DecodeMessage<time_quality_t>(message)) time_.OnTime(*time, clock_.Now());
  });
  for (std::size_t set = 0; set < sets_.size(); ++set) {
    for (std::size_t axis = 0; axis < sets_[set].axes.size(); ++axis) {
      subscribed &=
          port_.Subscribe("POSITION/" + sets_[set].axes[axis],
                          [this, set, axis](const std::string&, Bytes message) { OnPosition(set, axis, message); });
    }
  }
  if (!subscribed) return Failure("cannot subscribe on LCM: " + port_.problem());
  return {};
}

void SetReception::OnPosition(std::size_t set, std::size_t axis, Bytes message) {
  if (const auto position = DecodeMessage<position_t>(message)) {
    builders_[set].OnPosition(axis, *position, clock_.Now());
    static_cast<void>(PassClosed());
  }
}

MonoNs SetReception::PassClosed() {
  MonoNs next = kNever;
  const MonoNs now = clock_.Now();
  for (std::size_t set = 0; set < builders_.size(); ++set) {
    while (const position_set_t* closed = builders_[set].Next(now)) take_(sets_[set], *closed);
    next = std::min(next, builders_[set].NextAt());
  }
  return next;
}

bool SetReception::Gather(MonoNs until) {
  for (MonoNs now = clock_.Now(); now < until; now = clock_.Now()) {
    const MonoNs wait = std::min(PassClosed(), until) - now;
    if (!port_.Handle(static_cast<int>(std::max<MonoNs>(0, wait) / kMillisecond) + 1)) return false;
  }
  static_cast<void>(PassClosed());
  return true;
}

PositionSetBuilder::Totals SetReception::totals() const {
  PositionSetBuilder::Totals sum;
  for (const PositionSetBuilder& builder : builders_) {
    sum.sets += builder.totals().sets;
    sum.late += builder.totals().late;
    sum.no_tick += builder.totals().no_tick;
  }
  return sum;
}

}  // namespace axlecast
