#include "tools/monitor/machine_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/alarm_t.hpp>

#include <cmath>

#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

constexpr MonoNs kNow = 100 * kSecond;

TEST(MachineView, BeginsWithTheDevicesOfTheFile) {
  const MachineView view(OneAxis());
  ASSERT_EQ(view.devices().size(), 1U);
  EXPECT_EQ(view.devices()[0].bus, "rs485-0");
  EXPECT_FALSE(view.devices()[0].State(kNow));
  EXPECT_FALSE(view.AllOnline(kNow));
  EXPECT_FALSE(view.AllReceived());
  EXPECT_TRUE(view.NothingReceived());
  EXPECT_TRUE(std::isnan(view.devices()[0].Turns()));
}

TEST(MachineView, IsOnlineWhenDeviceAndBusSaySo) {
  MachineView view(OneAxis());
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  EXPECT_FALSE(view.AllOnline(kNow));
  view.OnMessage("BUS/rs485-0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  EXPECT_TRUE(view.AllOnline(kNow));
  EXPECT_TRUE(view.AllReceived());
  view.OnMessage("BUS/rs485-0", Encoded(BusMessage(bus_health_t::STATE_DEGRADED)), kNow);
  EXPECT_FALSE(view.AllOnline(kNow));
}

TEST(MachineView, AnOldStateIsNoState) {
  MachineView view(OneAxis());
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  EXPECT_TRUE(view.devices()[0].Online(kNow + kStaleAfter));
  EXPECT_FALSE(view.devices()[0].Online(kNow + kStaleAfter + 1));
  EXPECT_TRUE(view.devices()[0].was_online);
}

// DEVICE comes once a second: where it alone was lost, a device whose positions came was called SILENT.
TEST(MachineView, ADeviceWhosePositionsComeIsNotSilent) {
  MachineView view(OneAxis());
  view.OnMessage("POSITION/axis1", Encoded(PositionMessage(0)), kNow);
  EXPECT_EQ(view.devices()[0].State(kNow), device_info_t::STATE_ONLINE);
  EXPECT_TRUE(view.devices()[0].was_online);
  EXPECT_TRUE(view.AllOnline(kNow)) << "its bus works, too";
  EXPECT_FALSE(view.NothingReceived());
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_DEGRADED)), kNow);
  const MonoNs later = kNow + kStaleAfter + 1;
  EXPECT_FALSE(view.devices()[0].State(later));
  view.OnMessage("POSITION/axis1", Encoded(PositionMessage(1)), later);
  EXPECT_EQ(view.devices()[0].State(later), device_info_t::STATE_DEGRADED);
  EXPECT_FALSE(view.devices()[0].State(later + kStaleAfter + 1));
  EXPECT_FALSE(view.buses()[0].State(later + kStaleAfter + 1));
}

TEST(MachineView, InvalidPositionsKeepTheStateThatWasReportedLast) {
  MachineView view(OneAxis());
  position_t invalid = PositionMessage(0);
  invalid.flags = 0;
  view.OnMessage("POSITION/axis1", Encoded(invalid), kNow);
  EXPECT_FALSE(view.devices()[0].State(kNow));
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_OFFLINE)), kNow);
  view.OnMessage("POSITION/axis1", Encoded(invalid), kNow + kStaleAfter + 1);
  EXPECT_EQ(view.devices()[0].State(kNow + kStaleAfter + 1), device_info_t::STATE_OFFLINE);
  EXPECT_FALSE(view.buses()[0].State(kNow));
}

TEST(MachineView, TurnsAndSpeedInShaftUnits) {
  MachineView view(OneAxis());
  view.OnMessage("POSITION/axis1", Encoded(PositionMessage(0)), kNow);
  EXPECT_DOUBLE_EQ(view.devices()[0].Turns(), 12.5);
  EXPECT_NEAR(view.devices()[0].SpeedRpm(), 60, 1e-9);
}

TEST(MachineView, AnInvalidPositionKeepsTheLastValidOne) {
  MachineView view(OneAxis());
  view.OnMessage("POSITION/axis1", Encoded(PositionMessage(0)), kNow);
  position_t doubtful = PositionMessage(1);
  doubtful.flags = position_t::FLAG_IMPLAUSIBLE;
  doubtful.counts = 0;
  view.OnMessage("POSITION/axis1", Encoded(doubtful), kNow);
  EXPECT_DOUBLE_EQ(view.devices()[0].Turns(), 12.5);
  EXPECT_TRUE(std::isnan(view.devices()[0].SpeedRpm()));
  EXPECT_EQ(view.devices()[0].valid_readings, 1);
  EXPECT_EQ(view.devices()[0].readings.received(), 2);
}

TEST(MachineView, CountsWhatWasLostOnTheWay) {
  MachineView view(OneAxis());
  for (const std::int64_t seq : {10, 11, 15}) view.OnMessage("POSITION/axis1", Encoded(PositionMessage(seq)), kNow);
  EXPECT_EQ(view.devices()[0].readings.lost(), 3);
}

TEST(MachineView, KeepsTheTripLimitsOfAMotor) {
  MachineConfig machine = OneAxis();
  MachineView view(machine, Unlisted::kShown);
  motor_limits_t limits{};
  limits.overheat_c = 90;
  EXPECT_EQ(view.OnMessage("LIMITS/axis1", Encoded(limits), kNow).kind, MonitorUpdate::Kind::kNothing)
      << "an encoder";
  EXPECT_EQ(view.OnMessage("LIMITS/gm1", Encoded(limits), kNow).kind, MonitorUpdate::Kind::kNothing)
      << "not known yet";
  view.OnMessage("DEVICE/gm1", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  view.OnMessage("MOTOR/gm1", Encoded(motor_health_t{}), kNow);
  EXPECT_EQ(view.OnMessage("LIMITS/gm1", Encoded(limits), kNow).kind, MonitorUpdate::Kind::kMotorLimits);
  limits.overheat_c = 80;
  view.OnMessage("LIMITS/gm1", Encoded(limits), kNow + kSecond);
  ASSERT_TRUE(view.devices()[1].limits);
  EXPECT_EQ(view.devices()[1].limits->overheat_c, 80);
  EXPECT_EQ(view.devices()[1].limits_at, kNow + kSecond);
  view.OnMessage("LIMITS/gm1", Encoded(position_t{}), kNow + 2 * kSecond);
  EXPECT_EQ(view.devices()[1].limits_at, kNow + kSecond) << "of another type";
}

TEST(MachineView, RateOverAFullSecond) {
  MachineView view(OneAxis());
  view.Tick(kNow);
  for (std::int64_t seq = 0; seq < 50; ++seq) view.OnMessage("POSITION/axis1", Encoded(PositionMessage(seq)), kNow);
  view.Tick(kNow + kSecond / 2);
  EXPECT_DOUBLE_EQ(view.devices()[0].reading_hz, 0);
  view.Tick(kNow + 2 * kSecond);
  EXPECT_DOUBLE_EQ(view.devices()[0].reading_hz, 25);
}

TEST(MachineView, RemembersAlarmsThatHaveGone) {
  MachineView view(OneAxis());
  alarm_t alarm{};
  alarm.n = 1;
  alarm.entries.resize(1);
  alarm.entries[0].name = "battery_alarm";
  view.OnMessage("ALARM/axis1", Encoded(alarm), kNow);
  view.OnMessage("ALARM/axis1", Encoded(alarm_t{}), kNow);
  EXPECT_TRUE(view.devices()[0].alarms.entries().empty());
  EXPECT_EQ(view.devices()[0].alarms.seen().count("battery_alarm"), 1U);
}

TEST(MachineView, KnowsWhetherABridgeServesAndItsAlarms) {
  MachineView view(OneAxis());
  EXPECT_FALSE(view.bridge().Fresh(kNow));
  alarm_t alarm{};
  alarm.n = 1;
  alarm.entries.resize(1);
  alarm.entries[0].name = "journal_fails";
  view.OnMessage("ALARM/bridge", Encoded(alarm), kNow);
  EXPECT_TRUE(view.bridge().Fresh(kNow + kStaleAfter));
  EXPECT_FALSE(view.bridge().Fresh(kNow + kStaleAfter + 1));
  ASSERT_EQ(view.bridge().entries().size(), 1U);
  EXPECT_EQ(view.bridge().entries()[0].name, "journal_fails");
  view.OnMessage("ALARM/bridge", Encoded(position_t{}), kNow + 10 * kSecond);
  EXPECT_FALSE(view.bridge().Fresh(kNow + 10 * kSecond)) << "no alarm message";
}

TEST(MachineView, IgnoresWhatIsNotItsOwn) {
  MachineView view(OneAxis());
  const auto position = Encoded(PositionMessage(0));
  view.OnMessage("POSITION/axis2", position, kNow);
  view.OnMessage("POSITION", position, kNow);
  view.OnMessage("DEVICE/axis1", position, kNow);
  view.OnMessage("POSITION/axis1", Bytes(position).first(20), kNow);
  EXPECT_EQ(view.devices()[0].readings.received(), 0);
  EXPECT_TRUE(view.NothingReceived());
}

TEST(MachineView, FindsPartsByNameAlsoInACopy) {
  MachineView first(Axes(300), Unlisted::kShown);
  first.OnMessage("DEVICE/guest", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  const MachineView view = first;
  for (const DeviceView& device : view.devices()) EXPECT_EQ(view.FindDevice(device.name), &device);
  for (const BusView& bus : view.buses()) EXPECT_EQ(view.FindBus(bus.name), &bus);
  EXPECT_EQ(view.devices().size(), 301U);
  EXPECT_EQ(view.FindDevice("axis300"), nullptr);
  EXPECT_EQ(view.FindBus("line300"), nullptr);
}

TEST(MachineView, TheLayoutChangesOnlyWithTheParts) {
  MachineView view(Axes(2), Unlisted::kShown);
  const std::uint64_t listed = view.layout();
  view.OnMessage("DEVICE/axis0", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  view.OnMessage("BUS/line0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  view.OnMessage("POSITION/axis0", Encoded(PositionMessage(0)), kNow);
  EXPECT_EQ(view.layout(), listed) << "the machine file lists them";
  view.OnMessage("DEVICE/guest", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  const std::uint64_t with_guest = view.layout();
  EXPECT_GT(with_guest, listed);
  view.OnMessage("DEVICE/guest", Encoded(DeviceMessage(device_info_t::STATE_DEGRADED)), kNow);
  EXPECT_EQ(view.layout(), with_guest);
  view.OnMessage("MOTOR/guest", Encoded(motor_health_t{}), kNow);
  const std::uint64_t with_motor = view.layout();
  EXPECT_GT(with_motor, with_guest) << "it turns out to be a motor";
  view.OnMessage("MOTOR/guest", Encoded(motor_health_t{}), kNow);
  EXPECT_EQ(view.layout(), with_motor);
  view.OnMessage("BUS_TIMES/line9", Encoded(exchange_times_t{}), kNow);
  const std::uint64_t with_bus = view.layout();
  EXPECT_GT(with_bus, with_motor);
  view.OnMessage("BUS/line9", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  EXPECT_GT(view.layout(), with_bus) << "its family becomes known";
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;

MachineView Good() {
  MachineView view(OneAxis());
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  view.OnMessage("BUS/rs485-0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  return view;
}

alarm_t Alarm(const char* name, std::int8_t severity) {
  alarm_t message{};
  alarm_entry_t entry{};
  entry.name = name;
  entry.severity = severity;
  entry.action = "do this";
  message.entries = {entry};
  message.n = 1;
  message.total = 1;
  return message;
}

TEST(MachineFaults, AGoodMachineHasNone) { EXPECT_THAT(MachineFaults(Good(), kNow), IsEmpty()); }

TEST(MachineFaults, DegradedIsNotGood) {
  MachineView view = Good();
  device_info_t info = DeviceMessage(device_info_t::STATE_DEGRADED);
  info.reason = "every second reply is damaged";
  view.OnMessage("DEVICE/axis1", Encoded(info), kNow);
  EXPECT_THAT(MachineFaults(view, kNow), ElementsAre("axis1: DEGRADED (every second reply is damaged)"));
}

TEST(MachineFaults, SilenceAndABusThatIsDownAreNotGood) {
  EXPECT_THAT(MachineFaults(MachineView(OneAxis()), kNow),
              ElementsAre("axis1: no message of its driver was received", "rs485-0: the bus never reported"));
  EXPECT_THAT(MachineFaults(Good(), kNow + 10 * kSecond), ElementsAre("axis1: SILENT", "rs485-0: SILENT"));
}

TEST(MachineFaults, AlarmsOfTheBridgeCountFromErrorOn) {
  MachineView view = Good();
  view.OnMessage("ALARM/bridge", Encoded(Alarm("unsigned_allowed", alarm_entry_t::SEVERITY_INFO)), kNow);
  EXPECT_THAT(MachineFaults(view, kNow), IsEmpty());
  view.OnMessage("ALARM/bridge", Encoded(Alarm("journal_fails", alarm_entry_t::SEVERITY_ERROR)), kNow);
  EXPECT_THAT(MachineFaults(view, kNow), ElementsAre("bridge: journal_fails: do this"));
}

TEST(MachineFaults, ABrokerThatIsAwayIsNotGood) {
  MachineView view = Good();
  view.OnMessage("ALARM/mqtt/press3", Encoded(Alarm("broker_away", alarm_entry_t::SEVERITY_WARNING)), kNow);
  EXPECT_THAT(MachineFaults(view, kNow), ElementsAre("mqtt: broker_away: do this"));
}

TEST(MachineFaults, AFleetDatabaseThatIsAwayIsNotGood) {
  MachineView view = Good();
  const std::vector<std::uint8_t> alarm = Encoded(Alarm("database_away", alarm_entry_t::SEVERITY_WARNING));
  view.OnMessage("ALARM/ship/another", alarm, kNow);
  EXPECT_THAT(MachineFaults(view, kNow), IsEmpty());
  view.OnMessage("ALARM/ship/press3", alarm, kNow);
  EXPECT_THAT(MachineFaults(view, kNow), ElementsAre("ship: database_away: do this"));
}

}  // namespace
}  // namespace axlecast
