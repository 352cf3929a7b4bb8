#include "core/config/sets.h"

#include <algorithm>
#include <axlecast/position_set_t.hpp>
#include <set>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/config_map.h"
#include "core/config/hosts.h"
#include "core/config/ticks.h"

namespace axlecast {
namespace {

std::string DigitsOf(double hz) { return Text("%.9g", hz); }

// Returns why the readings of the device are on no tick; empty if they are.
std::string WhyNotOnTicks(const BusConfig& bus, const DeviceConfig& device) {
  if (!bus.family->has_position) return "is no encoder";
  if (device.settings->own_period > 0)
    return "sends by itself, so that its readings are on no tick: choose the mode in which it is polled";
  if (bus.poll_hz <= 0) return "is read as fast as the bus allows, on no tick: set poll_hz of bus " + bus.name;
  if (TicksPerMessage(bus, device) == 0) {
    return "is read at " + DigitsOf(bus.poll_hz) + " Hz and published at " + DigitsOf(device.publish_hz) +
           " Hz: poll_hz must be a whole multiple of publish_hz";
  }
  return "";
}

MonoNs PeriodOf(const BusConfig& bus, const DeviceConfig& device) {
  return TicksOf(bus).period * TicksPerMessage(bus, device);
}

Result<> CheckBases(const MachineConfig& machine, const std::vector<std::string>& axes) {
  if (!machine.time.root.empty()) return {};
  std::set<const HostConfig*> hosts;
  for (const std::string& axis : axes) hosts.insert(HostOfBus(machine.hosts, machine.BusOf(axis)->name));
  if (hosts.size() < 2) return {};
  return Failure(
      "the axes are on several hosts, which have common ticks only with a time base: add `time: {root: HOST, "
      "address: "
      "IP ADDRESS OF HOST}`");
}

}  // namespace

Result<SetConfig> MakeSet(const MachineConfig& machine, const std::vector<std::string>& axes) {
  SetConfig set;
  set.axes = axes;
  if (axes.empty()) return Failure("names no axis");
  if (axes.size() > position_set_t::MAX_AXES)
    return Failure(std::to_string(axes.size()) + " axes: at most " + std::to_string(position_set_t::MAX_AXES));
  const BusConfig* first_bus = nullptr;
  for (const std::string& axis : axes) {
    const BusConfig* bus = machine.BusOf(axis);
    const DeviceConfig* device = machine.FindDevice(axis);
    if (bus == nullptr || device == nullptr) return Failure("there is no device " + Quoted(axis));
    if (const std::string why = WhyNotOnTicks(*bus, *device); !why.empty())
      return Failure(Quoted(axis) + ' ' + why);
    if (first_bus == nullptr) {
      first_bus = bus;
      set.period = PeriodOf(*bus, *device);
    }
    if (PeriodOf(*bus, *device) != set.period) {
      return Failure(Quoted(axes.front()) + " and " + Quoted(axis) +
                     " are published at different rates: give both the same publish_hz");
    }
    if (TicksOf(*bus).phase != TicksOf(*first_bus).phase) {
      return Failure(Quoted(axes.front()) + " and " + Quoted(axis) +
                     " are on buses with different phase_us: their ticks never coincide");
    }
  }
  if (const Result<> bases = CheckBases(machine, axes); !bases) return Failure(bases.error().text);
  return set;
}

std::vector<SetConfig> LoadSets(ConfigMap& root, const MachineConfig& machine) {
  constexpr std::int64_t kMaxLimitUs = 1'000'000;
  std::vector<SetConfig> sets;
  for (auto& [name, map] : root.Maps("sets")) {
    map.CheckName(name);
    map.MarkRequired("axes");
    const std::vector<std::string> axes = map.Strings("axes");
    Result<SetConfig> set = root.errors().empty() ? MakeSet(machine, axes) : SetConfig{};
    if (!set) {
      map.Error("axes", set.error().text);
      set = SetConfig{};
    }
    set->name = name;
    map.Require("limit_us", "the widest hull of the sampling instants that counts as aligned, e.g. 300");
    set->limit = map.Integer("limit_us", 1, 1, kMaxLimitUs, "us") * kMicrosecond;
    map.Done();
    sets.push_back(std::move(*set));
  }
  return sets;
}

}  // namespace axlecast
