#include "tools/monitor/machine_counts.h"

#include <gtest/gtest.h>
#include <axlecast/alarm_t.hpp>
#include <string>

#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

constexpr MonoNs kNow = 100 * kSecond;

void SetState(MachineView& view, const std::string& device, std::int8_t state) {
  view.OnMessage("DEVICE/" + device, Encoded(DeviceMessage(state)), kNow);
}

void SetAlarm(MachineView& view, const std::string& sender, std::int8_t severity,
              std::int8_t state = alarm_entry_t::STATE_LIVE) {
  alarm_t message{};
  alarm_entry_t& entry = message.entries.emplace_back();
  entry.severity = severity;
  entry.state = state;
  message.n = 1;
  message.total = 1;
  view.OnMessage("ALARM/" + sender, Encoded(message), kNow);
}

TEST(MachineCounts, EveryDeviceAndBusHasOneState) {
  MachineView view(Axes(6));
  SetState(view, "axis0", device_info_t::STATE_ONLINE);
  SetState(view, "axis1", device_info_t::STATE_ONLINE);
  SetState(view, "axis2", device_info_t::STATE_DEGRADED);
  SetState(view, "axis3", device_info_t::STATE_OFFLINE);
  SetState(view, "axis4", device_info_t::STATE_STARTING);
  view.OnMessage("BUS/line0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  view.OnMessage("BUS/line1", Encoded(BusMessage(bus_health_t::STATE_DOWN)), kNow);
  const MachineCounts counts = CountParts(view, kNow);
  EXPECT_EQ(counts.devices.total, 6U);
  EXPECT_EQ(counts.devices.of[device_info_t::STATE_ONLINE], 2U);
  EXPECT_EQ(counts.devices.of[device_info_t::STATE_DEGRADED], 1U);
  EXPECT_EQ(counts.devices.of[device_info_t::STATE_OFFLINE], 1U);
  EXPECT_EQ(counts.devices.of[device_info_t::STATE_STARTING], 1U);
  EXPECT_EQ(counts.devices.silent, 1U);
  EXPECT_EQ(counts.buses.total, 6U);
  EXPECT_EQ(counts.buses.of[bus_health_t::STATE_UP], 1U);
  EXPECT_EQ(counts.buses.of[bus_health_t::STATE_DOWN], 1U);
  EXPECT_EQ(counts.buses.silent, 4U);
  EXPECT_EQ(CountParts(view, kNow + kStaleAfter + 1).devices.silent, 6U) << "states grow old";
}

TEST(MachineCounts, AlarmsOfEverySenderCountOnce) {
  MachineView view(Axes(3));
  SetAlarm(view, "axis0", alarm_entry_t::SEVERITY_CRITICAL);
  SetAlarm(view, "axis1", alarm_entry_t::SEVERITY_WARNING);
  SetAlarm(view, "axis2", alarm_entry_t::SEVERITY_CRITICAL, alarm_entry_t::STATE_SHELVED);
  SetAlarm(view, "bridge", alarm_entry_t::SEVERITY_INFO);
  SetAlarm(view, "mqtt/hall3", alarm_entry_t::SEVERITY_WARNING);
  SetAlarm(view, "ship/hall3", alarm_entry_t::SEVERITY_ERROR);
  const MachineCounts::Alarms alarms = CountParts(view, kNow).alarms;
  EXPECT_EQ(alarms.of[alarm_entry_t::SEVERITY_CRITICAL], 1U);
  EXPECT_EQ(alarms.of[alarm_entry_t::SEVERITY_ERROR], 1U);
  EXPECT_EQ(alarms.of[alarm_entry_t::SEVERITY_WARNING], 2U);
  EXPECT_EQ(alarms.of[alarm_entry_t::SEVERITY_INFO], 1U);
  EXPECT_EQ(alarms.shelved, 1U);
}

// Numbers from the network may be any.
TEST(MachineCounts, UnknownStatesAndSeveritiesAreNoStateOfTheTable) {
  MachineView view(Axes(2));
  SetState(view, "axis0", -1);
  SetState(view, "axis1", 127);
  SetAlarm(view, "axis0", -128);
  SetAlarm(view, "axis1", 4);
  const MachineCounts counts = CountParts(view, kNow);
  EXPECT_EQ(counts.devices.total, 2U);
  EXPECT_EQ(counts.devices.silent, 0U);
  for (const std::size_t count : counts.devices.of) EXPECT_EQ(count, 0U);
  for (const std::size_t count : counts.alarms.of) EXPECT_EQ(count, 0U);
}

TEST(MachineCounts, HostsOfTheFileAndOfTheTimeBase) {
  MachineConfig machine = Axes(2);
  machine.time.root = "plc1";
  machine.hosts = {{.name = "plc1", .buses = {"line0"}, .bridge = true}, {.name = "cell2", .buses = {"line1"}}};
  MachineView view(machine);
  EXPECT_EQ(CountParts(view, kNow).hosts.total, 2U);
  EXPECT_EQ(CountParts(view, kNow).hosts.silent, 2U);
  view.OnMessage("BUS/line0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  time_quality_t quality{};
  quality.half_width_ns = 1000;
  view.OnMessage("TIME/plc1", Encoded(quality), kNow);
  quality.half_width_ns = -1;
  view.OnMessage("TIME/guest3", Encoded(quality), kNow);  // a host that the file does not name
  const MachineCounts::Hosts hosts = CountParts(view, kNow).hosts;
  EXPECT_EQ(hosts.total, 3U);
  EXPECT_EQ(hosts.silent, 1U);
  EXPECT_EQ(hosts.claims, 1U);
}

TEST(NeedsAttention, ADeviceThatIsNotOnlineOrHasAWarning) {
  MachineView view(OneAxis());
  const auto needs = [&view] { return NeedsAttention(view.devices()[0], kNow); };
  EXPECT_TRUE(needs()) << "silent";
  SetState(view, "axis1", device_info_t::STATE_ONLINE);
  EXPECT_FALSE(needs());
  SetAlarm(view, "axis1", alarm_entry_t::SEVERITY_INFO);
  EXPECT_FALSE(needs());
  SetAlarm(view, "axis1", alarm_entry_t::SEVERITY_WARNING);
  EXPECT_TRUE(needs());
  SetAlarm(view, "axis1", alarm_entry_t::SEVERITY_WARNING, alarm_entry_t::STATE_SHELVED);
  EXPECT_FALSE(needs());
  SetState(view, "axis1", device_info_t::STATE_DEGRADED);
  EXPECT_TRUE(needs());
}

}  // namespace
}  // namespace axlecast
