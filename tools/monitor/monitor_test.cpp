#include "tools/monitor/monitor.h"

#include <gmock/gmock.h>

#include <limits>
#include <string>

#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;
using Kind = MonitorUpdate::Kind;

constexpr MonoNs kNow = 100 * kSecond;

alarm_entry_t Entry(std::int32_t code, const std::string& name) {
  alarm_entry_t entry{};
  entry.code = code;
  entry.name = name;
  return entry;
}

alarm_t AlarmMessage(std::int64_t utime, std::vector<alarm_entry_t> entries) {
  alarm_t alarm{};
  alarm.utime = utime;
  alarm.n = static_cast<std::int8_t>(entries.size());
  alarm.total = alarm.n;
  alarm.entries = std::move(entries);
  return alarm;
}

trip_log_t TripMessage(std::int32_t count, float volts) {
  trip_log_t trip{};
  trip.trip_count = count;
  trip.samples[0][19] = volts;
  trip.samples[1][0] = std::numeric_limits<float>::quiet_NaN();
  return trip;
}

command_status_t Status(std::uint8_t id, std::int8_t state, bool is_final) {
  command_status_t status{};
  status.id[0] = id;
  status.device = "axis1";
  status.state = state;
  status.is_final = is_final ? 1 : 0;
  return status;
}

recorder_health_t RecorderMessage(std::int8_t state) {
  recorder_health_t health{};
  health.name = "press3";
  health.state = state;
  return health;
}

// `axis1` of the machine file, and unlisted devices.
class MonitorTest : public ::testing::Test {
 protected:
  template <typename Message>
  MonitorUpdate Hear(const std::string& channel, const Message& message, MonoNs now = kNow) {
    return monitor_.OnMessage(channel, Encoded(message), now);
  }
  [[nodiscard]] const DeviceView& device(std::size_t i = 0) const { return monitor_.machine().devices().at(i); }

  Monitor monitor_{OneAxis()};
};

TEST_F(MonitorTest, TellsWhatAMessageTold) {
  EXPECT_EQ(Hear("POSITION/axis1", PositionMessage(0)).kind, Kind::kPosition);
  EXPECT_EQ(Hear("BUS/rs485-0", BusMessage(bus_health_t::STATE_UP)).kind, Kind::kBus);
  EXPECT_EQ(Hear("BUS_TIMES/rs485-0", exchange_times_t{}).kind, Kind::kExchangeTimes);
  EXPECT_EQ(Hear("ALARM/bridge", alarm_t{}).kind, Kind::kBridgeAlarms);
  EXPECT_EQ(Hear("RECORDER/press3", RecorderMessage(0)).kind, Kind::kRecorder);
  EXPECT_EQ(Hear("ALARM/recorder/press3", alarm_t{}).kind, Kind::kRecorderAlarms);
  EXPECT_EQ(Hear("TRIP/axis1", TripMessage(1, 200)).kind, Kind::kTrip);
  EXPECT_EQ(Hear("COMMAND_STATUS", Status(1, 1, false)).kind, Kind::kCommand);
  EXPECT_EQ(monitor_.passed_over(), 0);
}

TEST_F(MonitorTest, AStateIsNewsOnceAndAgainWhenItChanges) {
  const auto online = DeviceMessage(device_info_t::STATE_ONLINE);
  EXPECT_TRUE(Hear("DEVICE/axis1", online).changed);
  EXPECT_FALSE(Hear("DEVICE/axis1", online).changed);
  EXPECT_TRUE(Hear("DEVICE/axis1", DeviceMessage(device_info_t::STATE_OFFLINE)).changed);
  EXPECT_TRUE(Hear("RECORDER/press3", RecorderMessage(recorder_health_t::STATE_RECORDING)).changed);
  EXPECT_FALSE(Hear("RECORDER/press3", RecorderMessage(recorder_health_t::STATE_RECORDING)).changed);
  EXPECT_TRUE(Hear("RECORDER/press3", RecorderMessage(recorder_health_t::STATE_DISK_FULL)).changed);
  EXPECT_EQ(monitor_.recorders().at(0).State(kNow), recorder_health_t::STATE_DISK_FULL);
  EXPECT_FALSE(monitor_.recorders().at(0).State(kNow + kStaleAfter + 1));
}

TEST_F(MonitorTest, RemembersWhenAlarmsCameAndWent) {
  EXPECT_TRUE(Hear("ALARM/axis1", AlarmMessage(10, {Entry(1, "battery_alarm")})).changed);
  EXPECT_FALSE(Hear("ALARM/axis1", AlarmMessage(20, {Entry(1, "battery_alarm")})).changed);
  EXPECT_TRUE(Hear("ALARM/axis1", AlarmMessage(30, {Entry(2, "over_speed")})).changed);
  std::vector<std::string> changes;
  for (const AlarmView::Change& change : device().alarms.changes()) {
    changes.push_back(std::to_string(change.unix_us) + (change.appeared ? " + " : " - ") + change.entry.name);
  }
  EXPECT_THAT(changes, ElementsAre("10 + battery_alarm", "30 + over_speed", "30 - battery_alarm"));
}

TEST_F(MonitorTest, AnAlarmThatWorseOnesPushOutOfTheMessageHasNotGone) {
  Hear("ALARM/axis1", AlarmMessage(10, {Entry(1, "battery_alarm")}));
  alarm_t cut = AlarmMessage(20, {Entry(2, "over_speed")});
  cut.total = 2;
  EXPECT_TRUE(Hear("ALARM/axis1", cut).changed);
  EXPECT_EQ(device().alarms.total(), 2U);
  EXPECT_THAT(device().alarms.changes(), SizeIs(2));
}

TEST_F(MonitorTest, KeepsEachTripOnce) {
  EXPECT_TRUE(Hear("TRIP/axis1", TripMessage(1, 200)).changed);
  EXPECT_FALSE(Hear("TRIP/axis1", TripMessage(1, 200)).changed) << "the newest is repeated each minute";
  EXPECT_TRUE(Hear("TRIP/axis1", TripMessage(1, 180)).changed) << "the count was cleared, and it tripped again";
  EXPECT_THAT(device().trips, SizeIs(2));
  for (int i = 0; i < 100; ++i) Hear("TRIP/axis1", TripMessage(i, 210));
  EXPECT_THAT(device().trips, SizeIs(DeviceView::kMaxTrips));
  EXPECT_EQ(device().trips.back().trip_count, 99);
}

TEST_F(MonitorTest, ACommandHasOneOutcome) {
  EXPECT_TRUE(Hear("COMMAND_STATUS", Status(1, command_status_t::STATE_RUNNING, false)).changed);
  EXPECT_TRUE(Hear("COMMAND_STATUS", Status(1, command_status_t::STATE_SUCCEEDED, true)).changed);
  EXPECT_FALSE(Hear("COMMAND_STATUS", Status(1, command_status_t::STATE_SUCCEEDED, true)).changed)
      << "a repetition";
  EXPECT_FALSE(Hear("COMMAND_STATUS", Status(1, command_status_t::STATE_FAILED, true)).changed) << "never changes";
  EXPECT_FALSE(Hear("COMMAND_STATUS", Status(1, command_status_t::STATE_ROUTED, false)).changed) << "late";
  EXPECT_FALSE(Hear("COMMAND_STATUS", Status(2, command_status_t::STATE_UNKNOWN, true)).changed);
  ASSERT_THAT(monitor_.commands().newest(), SizeIs(1));
  EXPECT_EQ(monitor_.commands().newest()[0].state, command_status_t::STATE_SUCCEEDED);
  EXPECT_EQ(monitor_.commands().outcomes(command_status_t::STATE_SUCCEEDED), 1);
  EXPECT_EQ(monitor_.commands().outcomes(command_status_t::STATE_FAILED), 0);
}

TEST_F(MonitorTest, AFindingFollowsAnIndeterminate) {
  command_status_t status = Status(1, command_status_t::STATE_INDETERMINATE, true);
  EXPECT_TRUE(Hear("COMMAND_STATUS", status).changed);
  status.finding = command_status_t::FINDING_EFFECT_SEEN;
  EXPECT_TRUE(Hear("COMMAND_STATUS", status).changed);
  EXPECT_EQ(monitor_.commands().outcomes(command_status_t::STATE_INDETERMINATE), 1);
}

TEST_F(MonitorTest, NamesTheCommandThatWasHeardOfLast) {
  for (std::uint8_t id = 1; id <= 3; ++id)
    Hear("COMMAND_STATUS", Status(id, command_status_t::STATE_ACCEPTED, false));
  EXPECT_EQ(Hear("COMMAND_STATUS", Status(2, command_status_t::STATE_RUNNING, false)).index, 1U);
  EXPECT_EQ(Hear("COMMAND_STATUS", Status(4, command_status_t::STATE_ACCEPTED, false)).index, 3U);
}

TEST_F(MonitorTest, ShowsADeviceThatTheFileDoesNotList) {
  device_info_t info = DeviceMessage(device_info_t::STATE_ONLINE);
  info.bus = "rs485-7";
  EXPECT_EQ(Hear("MOTOR/gm1", motor_health_t{}).kind, Kind::kNothing) << "not before its DEVICE";
  EXPECT_EQ(Hear("DEVICE/gm1", info).index, 1U);
  EXPECT_EQ(device(1).bus, "rs485-7");
  EXPECT_FALSE(device(1).listed);
  EXPECT_EQ(Hear("MOTOR/gm1", motor_health_t{}).kind, Kind::kMotor);
  EXPECT_FALSE(device(1).has_position);
  EXPECT_EQ(Hear("BUS/rs485-7", BusMessage(bus_health_t::STATE_UP)).index, 1U);
}

TEST_F(MonitorTest, CountsLossesByChannel) {
  for (const std::int64_t seq : {0, 1, 5}) Hear("POSITION/axis1", PositionMessage(seq));
  const auto count = monitor_.channels().find("POSITION/axis1");
  ASSERT_NE(count, monitor_.channels().end());
  EXPECT_EQ(count->second.received(), 3);
  EXPECT_EQ(count->second.lost(), 3);
}

TEST_F(MonitorTest, HoldsNoMoreWhateverIsSent) {
  const auto info = DeviceMessage(device_info_t::STATE_ONLINE);
  for (int i = 0; i < 1'000; ++i) {
    const std::string name = "x" + std::to_string(i);
    Hear("DEVICE/" + name, info);
    Hear("BUS/" + name, BusMessage(bus_health_t::STATE_UP));
    Hear("RECORDER/" + name, RecorderMessage(0));
    Hear("ALARM/recorder/" + name, alarm_t{});
    Hear("POSITION/" + name, PositionMessage(0));
    Hear("UNKNOWN/" + name, PositionMessage(0));
    Hear("ALARM/axis1", AlarmMessage(i, {Entry(i, name)}));
    command_status_t status = Status(0, command_status_t::STATE_REJECTED, true);
    status.id[1] = static_cast<std::uint8_t>(i);
    status.id[2] = static_cast<std::uint8_t>(i >> 8);
    Hear("COMMAND_STATUS", status);
  }
  const MachineView& machine = monitor_.machine();
  EXPECT_THAT(machine.devices(), SizeIs(1 + MachineView::kMaxUnlisted));
  EXPECT_THAT(machine.buses(), SizeIs(1 + MachineView::kMaxUnlisted));
  EXPECT_EQ(machine.turned_away(), 2 * (1'000 - static_cast<std::int64_t>(MachineView::kMaxUnlisted)));
  EXPECT_THAT(monitor_.recorders(), SizeIs(Monitor::kMaxRecorders));
  EXPECT_THAT(monitor_.commands().newest(), SizeIs(CommandHistory::kMax));
  EXPECT_THAT(device().alarms.changes(), SizeIs(AlarmView::kMaxChanges));
  EXPECT_THAT(device().alarms.seen(), SizeIs(AlarmView::kMaxSeen));
  EXPECT_LE(monitor_.channels().size(), 5 * machine.devices().size());
  EXPECT_GT(monitor_.passed_over(), 1'000);
}

TEST(MonitorRecordersTest, InventedNamesTakeNoPlaceOfARecorderOfTheMachine) {
  MachineConfig machine = OneAxis();
  machine.machine = "press3";
  machine.recorder.logs.emplace_back().name = "alarms";
  Monitor monitor(machine);
  const auto health = Encoded(RecorderMessage(0));
  for (int i = 0; i < 100; ++i) monitor.OnMessage("RECORDER/x" + std::to_string(i), health, kSecond);
  for (const char* name : {"press3", "alarms"}) monitor.OnMessage("RECORDER/" + std::string(name), health, kSecond);
  EXPECT_THAT(monitor.recorders(), SizeIs(Monitor::kMaxRecorders + 2));
  EXPECT_EQ(monitor.recorders().back().name, "alarms");
}

TEST(MonitorWithoutAFileTest, ShowsWhatALogHoldsBoundedToo) {
  Monitor monitor{MachineConfig{}};
  const auto info = Encoded(DeviceMessage(device_info_t::STATE_ONLINE));
  const auto bus = Encoded(BusMessage(bus_health_t::STATE_UP));
  for (int i = 0; i < 1'000; ++i) {
    monitor.OnMessage("DEVICE/x" + std::to_string(i), info, kSecond);
    monitor.OnMessage("BUS/x" + std::to_string(i), bus, kSecond);
  }
  EXPECT_THAT(monitor.machine().devices(), SizeIs(MachineView::kMaxUnlistedDevices));
  EXPECT_THAT(monitor.machine().buses(), SizeIs(MachineView::kMaxUnlistedBuses));
}

TEST_F(MonitorTest, PassesOverWhatIsNoNameTooLongOrMalformed) {
  const auto info = DeviceMessage(device_info_t::STATE_ONLINE);
  for (const char* channel : {"DEVICE/", "DEVICE/Axis", "DEVICE/a\nb", "DEVICE/a/b", "BUS/ ", "RECORDER/"}) {
    EXPECT_EQ(Hear(channel, info).kind, Kind::kNothing) << channel;
  }
  device_info_t large = info;
  large.reason.assign(Monitor::kLargestMessage, 'x');
  EXPECT_EQ(Hear("DEVICE/axis1", large).kind, Kind::kNothing);
  EXPECT_EQ(Hear("DEVICE/axis1", PositionMessage(0)).kind, Kind::kNothing);
  EXPECT_EQ(monitor_.OnMessage("COMMAND_STATUS", {}, kNow).kind, Kind::kNothing);
  EXPECT_THAT(monitor_.machine().devices(), SizeIs(1));
  EXPECT_TRUE(monitor_.channels().empty());
}

}  // namespace
}  // namespace axlecast
