#include "tools/monitor/machine_counts.h"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace axlecast {
namespace {

// `number` may be any value: it comes from the network.
template <std::size_t Size>
void CountOne(std::array<std::size_t, Size>& counts, std::int8_t number) {
  const auto index = static_cast<std::uint8_t>(number);  // above 127 for a negative one
  if (index < Size) ++counts[index];
}

void CountState(MachineCounts::States& counts, std::optional<std::int8_t> state) {
  ++counts.total;
  if (state) {
    CountOne(counts.of, *state);
  } else {
    ++counts.silent;
  }
}

void CountAlarms(MachineCounts::Alarms& counts, const AlarmView& alarms) {
  for (const alarm_entry_t& alarm : alarms.entries()) {
    if (alarm.state == alarm_entry_t::STATE_SHELVED) {
      ++counts.shelved;
    } else {
      CountOne(counts.of, alarm.severity);
    }
  }
}

MachineCounts::Hosts CountHosts(const MachineView& machine, MonoNs now) {
  MachineCounts::Hosts counts;
  const auto time_of = [&machine](const HostConfig& host) {
    return std::ranges::find(machine.hosts(), host.name, &HostView::name);
  };
  for (const HostConfig& host : machine.placement()) {
    ++counts.total;
    const auto time = time_of(host);
    const bool time_ended = time != machine.hosts().end() && !time->State(now);
    if (time_ended || IsSilent(host, machine, now)) ++counts.silent;
  }
  for (const HostView& host : machine.hosts()) {
    if (host.Claims(now)) ++counts.claims;
    if (std::ranges::find(machine.placement(), host.name, &HostConfig::name) != machine.placement().end()) continue;
    ++counts.total;
    if (!host.State(now)) ++counts.silent;
  }
  return counts;
}

}  // namespace

MachineCounts CountParts(const MachineView& machine, MonoNs now) {
  MachineCounts counts;
  for (const DeviceView& device : machine.devices()) {
    CountState(counts.devices, device.State(now));
    CountAlarms(counts.alarms, device.alarms);
  }
  for (const BusView& bus : machine.buses()) CountState(counts.buses, bus.State(now));
  if (machine.bridge().Fresh(now)) CountAlarms(counts.alarms, machine.bridge());
  for (const AlarmView* alarms : {&machine.broker(), &machine.shipper()}) {
    if (alarms->Fresh(now)) CountAlarms(counts.alarms, *alarms);
  }
  counts.hosts = CountHosts(machine, now);
  return counts;
}

bool NeedsAttention(const DeviceView& device, MonoNs now) {
  return !device.Online(now) || std::ranges::any_of(device.alarms.entries(), [](const alarm_entry_t& alarm) {
    return alarm.severity >= alarm_entry_t::SEVERITY_WARNING && alarm.state != alarm_entry_t::STATE_SHELVED;
  });
}

}  // namespace axlecast
