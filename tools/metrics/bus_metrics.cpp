#include "tools/metrics/metrics_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "core/device/reading.h"
#include "tools/metrics/exposition.h"

namespace axlecast {
namespace {

using Type = Exposition::Type;

// bus_health_t STATE_*, and "silent" without messages of its driver.
constexpr std::array<std::string_view, 5> kStates = {"starting", "up", "degraded", "down", "silent"};

template <typename Value>
void Each(Exposition& out, const MachineView& machine, Value value) {
  for (const BusView& bus : machine.buses()) {
    if (bus.listed && bus.health) out.Add({{"bus", bus.name}}, value(*bus.health));
  }
}

// Momentary values, only while the driver reports.
template <typename Value>
void EachNow(Exposition& out, const MachineView& machine, MonoNs now, Value value) {
  for (const BusView& bus : machine.buses()) {
    const bus_health_t* health = bus.listed ? bus.FreshHealth(now) : nullptr;
    if (health == nullptr) continue;
    const auto number = static_cast<double>(value(*health));
    if (!std::isnan(number)) out.Add({{"bus", bus.name}}, number);
  }
}

void AddInfo(Exposition& out, const MachineView& machine) {
  out.Family("axlecast_bus_info", Type::kGauge, "What a bus is; always 1.");
  for (const BusView& bus : machine.buses()) {
    if (!bus.listed || !bus.health) continue;
    out.Add({{"bus", bus.name}, {"family", bus.health->family}, {"port", bus.health->port}}, std::int64_t{1});
  }
}

void AddCounters(Exposition& out, const MachineView& machine) {
  out.Family("axlecast_bus_exchanges_total", Type::kCounter, "Exchanges of all kinds since the driver started.");
  Each(out, machine, [](const bus_health_t& bus) { return bus.exchanges; });
  out.Family("axlecast_bus_readings_total", Type::kCounter, "Good readings of the bus's devices.");
  Each(out, machine, [](const bus_health_t& bus) { return bus.good; });
  out.Family(
      "axlecast_bus_errors_total", Type::kCounter,
      "What failed, by kind: readings of its devices, damaged characters (framing), losses of the line (io).");
  for (const BusView& bus : machine.buses()) {
    if (!bus.listed || !bus.health) continue;
    for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
      out.Add({{"bus", bus.name}, {"kind", ErrorName(static_cast<ErrorKind>(kind))}}, bus.health->errors[kind]);
    }
  }
  out.Family("axlecast_bus_late_slots_total", Type::kCounter, "Poll slots that were missed.");
  Each(out, machine, [](const bus_health_t& bus) { return bus.late; });
  out.Family("axlecast_bus_receive_dropped_total", Type::kCounter,
             "Characters or frames that were received and lost by the kernel or the adapter.");
  Each(out, machine, [](const bus_health_t& bus) { return bus.rx_dropped; });
  out.Family("axlecast_bus_reopens_total", Type::kCounter, "Times the line was opened again.");
  Each(out, machine, [](const bus_health_t& bus) { return std::int64_t{bus.reopens}; });
}

void AddRates(Exposition& out, const MachineView& machine, MonoNs now) {
  out.Family("axlecast_bus_exchange_rate_hertz", Type::kGauge, "Exchanges a second over the last second.");
  EachNow(out, machine, now, [](const bus_health_t& bus) { return bus.rate_hz; });
  out.Family("axlecast_bus_wire_limit_hertz", Type::kGauge,
             "Readings a second that the wire's timing allows; absent where it is not known.");
  EachNow(out, machine, now,
          [](const bus_health_t& bus) { return bus.wire_limit_hz > 0 ? bus.wire_limit_hz : NAN; });
  out.Family("axlecast_bus_utilisation_ratio", Type::kGauge, "Share of the wire's limit in use, 0 to 1.");
  EachNow(out, machine, now, [](const bus_health_t& bus) { return bus.wire_limit_hz > 0 ? bus.utilisation : NAN; });
  out.Family("axlecast_bus_can_transmit_errors", Type::kGauge, "The CAN controller's transmit error counter.");
  EachNow(out, machine, now, [](const bus_health_t& bus) { return bus.can_tec < 0 ? NAN : bus.can_tec; });
  out.Family("axlecast_bus_can_receive_errors", Type::kGauge, "The CAN controller's receive error counter.");
  EachNow(out, machine, now, [](const bus_health_t& bus) { return bus.can_rec < 0 ? NAN : bus.can_rec; });
}

// Anybody may send anything: a histogram that falls would void the whole text.
bool MakesSense(const exchange_times_t& times) {
  return !times.bound_us.empty() && times.within.size() == times.bound_us.size() && times.bound_us.front() > 0 &&
         std::ranges::is_sorted(times.bound_us, std::ranges::less_equal()) &&
         std::ranges::is_sorted(times.within) && times.within.front() >= 0 && times.within.back() <= times.total &&
         times.sum_us >= 0;
}

void AddTimes(Exposition& out, const MachineView& machine) {
  out.Family("axlecast_bus_exchange_seconds", Type::kHistogram,
             "How long answered exchanges took, from before the write to after the last read.");
  for (const BusView& bus : machine.buses()) {
    if (!bus.listed || !bus.times || !MakesSense(*bus.times)) continue;
    const exchange_times_t& times = *bus.times;
    for (std::size_t i = 0; i < times.bound_us.size(); ++i) {
      out.Add("_bucket", {{"bus", bus.name}, {"le", MetricNumber(times.bound_us[i] / 1e6)}}, times.within[i]);
    }
    out.Add("_bucket", {{"bus", bus.name}, {"le", "+Inf"}}, times.total);
    out.Add("_sum", {{"bus", bus.name}}, static_cast<double>(times.sum_us) / 1e6);
    out.Add("_count", {{"bus", bus.name}}, times.total);
  }
}

}  // namespace

void AddBusMetrics(Exposition& out, const MachineView& machine, MonoNs now) {
  AddInfo(out, machine);
  out.Family("axlecast_bus_state", Type::kGauge,
             "1 for the state the bus is in, else 0; silent: its driver does not report.");
  for (const BusView& bus : machine.buses()) {
    if (bus.listed) AddStateSet(out, "bus", bus.name, kStates, bus.State(now));
  }
  AddCounters(out, machine);
  AddRates(out, machine, now);
  AddTimes(out, machine);
}

}  // namespace axlecast
