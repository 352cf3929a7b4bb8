#include <gmock/gmock.h>
#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <nlohmann/json.hpp>

#include "core/base/text.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/axlecast/live/format_machine.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr MonoNs kNow = 100 * kSecond;

MachineView Online() {
  MachineView view(OneAxis());
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  view.OnMessage("BUS/rs485-0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  view.OnMessage("POSITION/axis1", Encoded(PositionMessage(0)), kNow);
  return view;
}

TEST(Status, AllOnline) {
  const MachineView view = Online();
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("good: every device ONLINE, every bus UP\n"));
  const auto json = StatusJson(view, kNow);
  EXPECT_EQ(json["all_online"], true);
  EXPECT_EQ(json["good"], true);
  EXPECT_EQ(json["devices"][0]["device"], "axis1");
  EXPECT_EQ(json["devices"][0]["online"], true);
  EXPECT_EQ(json["devices"][0]["counts_per_turn"], 131072);
  EXPECT_EQ(json["buses"][0]["up"], true);
}

TEST(Status, NothingHeardIsNotOnline) {
  const MachineView view(OneAxis());
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("no driver answers"));
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("not good:\n  axis1: no message of its driver was received\n"));
  EXPECT_EQ(StatusJson(view, kNow)["devices"][0]["heard"], false);
}

TEST(Status, SaysWhatThisProcessLostAndWhatMendsIt) {
  MachineView view = Online();
  view.SetReceptionRemedy("as root: sysctl");
  EXPECT_THAT(StatusText(view, kNow), testing::Not(HasSubstr("lost because")));
  view.OnReception({.messages = 10, .dropped = 7});
  EXPECT_THAT(StatusText(view, kNow),
              HasSubstr("7 datagrams lost because this process's receive buffer was full (as root: sysctl)\n"));
  EXPECT_EQ(StatusJson(view, kNow)["reception"]["dropped"], 7);
}

TEST(Status, WarnsOfUnsignedCommands) {
  EXPECT_THAT(StatusText(Online(), kNow), testing::Not(HasSubstr("warning")));
  EXPECT_TRUE(StatusJson(Online(), kNow)["warnings"].empty());
  MachineConfig machine = OneAxis();
  machine.bridge.allow_unsigned = true;
  const MachineView view(machine);
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("warning: unsigned commands are obeyed"));
  EXPECT_EQ(StatusJson(view, kNow)["warnings"].size(), 1U);
}

TEST(Status, ShowsTheBridgeAndItsAlarms) {
  MachineView view = Online();
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("bridge                   SILENT"));
  EXPECT_EQ(StatusJson(view, kNow)["bridge"]["serves"], false);
  alarm_t alarm{};
  view.OnMessage("ALARM/bridge", Encoded(alarm), kNow);
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("bridge                   SERVING\n"));
  alarm.n = 1;
  alarm.entries.resize(1);
  alarm.entries[0].name = "journal_fails";
  alarm.entries[0].severity = alarm_entry_t::SEVERITY_ERROR;
  alarm.entries[0].action = "make room on disk.";
  view.OnMessage("ALARM/bridge", Encoded(alarm), kNow);
  EXPECT_THAT(StatusText(view, kNow),
              HasSubstr("bridge                   SERVING   journal_fails (error): make room on disk.\n"));
  EXPECT_EQ(StatusJson(view, kNow)["bridge"]["alarms"][0]["name"], "journal_fails");
  EXPECT_EQ(StatusJson(view, kNow)["good"], false);
  EXPECT_EQ(StatusJson(view, kNow)["faults"][0], "bridge: journal_fails: make room on disk.");
}

TEST(Info, TextAndJson) {
  const MachineView view = Online();
  const DeviceView& device = view.devices()[0];
  EXPECT_THAT(InfoText(device, kNow), HasSubstr("value             62.50000 mm\n"));
  EXPECT_THAT(InfoText(device, kNow), HasSubstr("flags             valid,speed_valid\n"));
  EXPECT_EQ(InfoJson(device)["position"]["counts"], 12 * 131072 + 65536);
  EXPECT_TRUE(InfoJson(device)["alarms"].is_array());
}

TEST(UnknownDevice, ListsTheDevicesThereAre) {
  EXPECT_EQ(UnknownDevice(OneAxis(), "axis2"),
            "no device 'axis2' in machine.yaml; did you mean axis1?\ndevices: axis1");
}

MachineView Running() {
  MachineView view(OneAxis());
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  view.OnMessage("POSITION/axis1", Encoded(PositionMessage(0)), kNow);
  bus_health_t health = BusMessage(bus_health_t::STATE_UP);
  health.errors[device_info_t::ERROR_TIMEOUT] = 3;
  health.errors[device_info_t::ERROR_CHECKSUM] = 1;
  view.OnMessage("BUS/rs485-0", Encoded(health), kNow);
  return view;
}

TEST(Table, ShowsDevicesAndBuses) {
  const auto lines = RenderTable(Running(), kNow, 61 * kSecond, {});
  EXPECT_THAT(lines.front(), HasSubstr("axlecast press3  00:01:01  1 of 1 devices online"));
  EXPECT_THAT(lines, Contains("axis1        ONLINE           62.50000 mm     12.500     60.0 "));
  EXPECT_THAT(lines, Contains(HasSubstr("1000 of 19608/s   5.1 %")));
  EXPECT_THAT(lines, Contains("  errors: timeout 3, checksum 1"));
}

TEST(Table, FitsEightyColumnsWhateverComes) {
  MachineConfig machine = OneAxis();
  machine.machine = std::string(60, 'm');
  machine.buses[0].name = std::string(24, 'b');
  machine.buses[0].devices[0].name = std::string(24, 'd');
  MachineView view(machine);
  position_t position = PositionMessage(0);
  position.value = -1.23456789e300;
  position.counts = INT64_MIN;
  device_info_t info = DeviceMessage(device_info_t::STATE_DEGRADED);
  info.reason = std::string(120, 'r');
  alarm_t alarm{};
  alarm.n = 3;
  alarm.entries.resize(3);
  alarm.entries[0].name = std::string(200, 'a');
  bus_health_t health = BusMessage(bus_health_t::STATE_DOWN);
  health.good = INT64_MAX;
  health.late = INT64_MAX;
  health.rate_hz = 3e38F;
  health.last_error = std::string(160, 'e');
  for (std::int64_t& errors : health.errors) errors = INT64_MAX;
  const std::string device = '/' + machine.buses[0].devices[0].name;
  view.OnMessage("POSITION" + device, Encoded(position), kNow);
  view.OnMessage("DEVICE" + device, Encoded(info), kNow);
  view.OnMessage("ALARM" + device, Encoded(alarm), kNow);
  view.OnMessage("BUS/" + machine.buses[0].name, Encoded(health), kNow);
  const auto lines = RenderTable(view, kNow, kNow, {std::string(300, 'x')});
  for (const std::string& line : lines) {
    const auto columns = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    EXPECT_LE(columns, static_cast<std::ptrdiff_t>(kTableWidth)) << line;
  }
}

TEST(Table, ASilentDriverIsToldAsSuch) {
  const auto lines = RenderTable(Running(), kNow + 3 * kSecond, kSecond, {});
  EXPECT_THAT(lines, Contains(StartsWith("axis1        SILENT")));
  EXPECT_THAT(lines, Contains(StartsWith("rs485-0      SILENT")));
  EXPECT_THAT(lines.front(), HasSubstr("0 of 1 devices online"));
}

TEST(Table, TextFromTheNetworkCannotSteerTheTerminal) {
  MachineView view = Running();
  alarm_t alarm{};
  alarm.n = 1;
  alarm.entries.resize(1);
  alarm.entries[0].name = "\x1b[2J";
  view.OnMessage("ALARM/axis1", Encoded(alarm), kNow);
  for (const std::string& line : RenderTable(view, kNow, kSecond, {"\x1b]0;x\a"})) {
    EXPECT_EQ(Printable(line), line);
  }
}

TEST(Table, LongEventsAreWrapped) {
  const std::string words =
      "0123456 012345678 012345678 012345678 012345678 012345678 012345678 012345678 next line";
  const auto lines = RenderTable(Running(), kNow, kSecond, {words});
  EXPECT_THAT(lines, Contains("0123456 012345678 012345678 012345678 012345678 012345678 012345678 012345678"));
  EXPECT_EQ(lines.back(), "    next line");
}

TEST(Table, OneLineForLogs) {
  EXPECT_EQ(RenderLine(Running(), kNow, 5 * kSecond), "00:00:05  1 of 1 devices online, 0 readings/s, 0 lost");
}

TEST(ValueText, HasTheDecimalsOfOneCount) {
  MachineView view = Running();
  EXPECT_EQ(ValueText(view.devices()[0]), "62.50000 mm");  // a count is 38 nm
  device_info_t info = DeviceMessage(device_info_t::STATE_ONLINE);
  info.counts_per_turn = 1;
  view.OnMessage("DEVICE/axis1", Encoded(info), kNow);
  EXPECT_EQ(ValueText(view.devices()[0]), "62 mm");
}

TEST(AlarmText, NamesTheWorstAndCountsTheRest) {
  DeviceView device;
  EXPECT_EQ(AlarmText(device, 18), "");
  alarm_t message{};
  for (const char* name : {"battery_alarm", "counter_overflow", "over_speed"}) {
    alarm_entry_t& entry = message.entries.emplace_back();
    entry.code = static_cast<std::int32_t>(message.entries.size());
    entry.name = name;
  }
  device.alarms.On(message, kNow);
  EXPECT_EQ(AlarmText(device, 18), "battery_alarm +2");
  EXPECT_EQ(AlarmText(device, 10), "batter\u2026 +2");
}

nlohmann::json Json(const RunSummary& summary) { return nlohmann::json::parse(summary.json); }

MachineView GoodRun() {
  MachineView view(OneAxis());
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  view.OnMessage("BUS/rs485-0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  for (std::int64_t seq = 0; seq < 20; ++seq) view.OnMessage("POSITION/axis1", Encoded(PositionMessage(seq)), kNow);
  return view;
}

TEST(RunSummary, AGoodRun) {
  const RunSummary summary = Summarize(GoodRun(), {}, kNow, 10 * kSecond);
  EXPECT_THAT(summary.faults, IsEmpty());
  EXPECT_TRUE(summary.Good());
  EXPECT_EQ(Json(summary)["good"], true);
  EXPECT_EQ(Json(summary)["devices"][0]["received"], 20);
  EXPECT_EQ(Json(summary)["devices"][0]["rate_hz"], 2.0);
  EXPECT_EQ(Json(summary)["devices"][0]["unit"], "mm");
  EXPECT_EQ(Json(summary)["buses"][0]["errors"].size(), 0U);
}

TEST(RunSummary, NothingHeard) {
  const RunSummary summary = Summarize(MachineView(OneAxis()), {}, kNow, kSecond);
  EXPECT_THAT(summary.faults, ElementsAre("axis1: no message of its driver was received",
                                          "rs485-0: the bus never reported", "axis1: no valid position"));
  EXPECT_TRUE(Json(summary)["devices"][0]["value"].is_null());
}

TEST(RunSummary, NeverOnlineWithItsReason) {
  MachineView view(OneAxis());
  device_info_t info = DeviceMessage(device_info_t::STATE_OFFLINE);
  info.reason = "no reply";
  view.OnMessage("DEVICE/axis1", Encoded(info), kNow);
  EXPECT_THAT(Summarize(view, {}, kNow, kSecond).faults,
              ::testing::IsSupersetOf({"axis1: OFFLINE (no reply)", "axis1: was never ONLINE"}));
}

TEST(RunSummary, LossesDeathsAndAnEndInSilence) {
  MachineView view = GoodRun();
  view.OnMessage("POSITION/axis1", Encoded(PositionMessage(25)), kNow);
  const RunSummary summary = Summarize(view, {"driver rs485-0: exit code 1"}, kNow + 5 * kSecond, 5 * kSecond);
  EXPECT_THAT(summary.faults,
              ElementsAre("axis1: SILENT", "rs485-0: SILENT", "axis1: 5 positions lost on the way here",
                          "driver rs485-0: exit code 1"));
  EXPECT_THAT(summary.text, HasSubstr("not good:\n  axis1: SILENT\n"));
}

TEST(RunSummary, SaysWhatThisProcessLostAndWhatMendsIt) {
  MachineView view = GoodRun();
  view.SetReceptionRemedy("as root: sysctl");
  EXPECT_THAT(Summarize(view, {}, kNow, kSecond).text, Not(HasSubstr("lost because")));
  view.OnReception({.messages = 10, .dropped = 7});
  const RunSummary summary = Summarize(view, {}, kNow, kSecond);
  EXPECT_THAT(summary.text,
              HasSubstr("7 datagrams lost because this process's receive buffer was full (as root: sysctl)\n"));
  EXPECT_EQ(Json(summary)["reception"]["dropped"], 7);
}

TEST(RunSummary, ADeviceThatIsDegradedAtTheEndIsAFault) {
  MachineView view = GoodRun();
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_DEGRADED)), kNow);
  const RunSummary summary = Summarize(view, {}, kNow, kSecond);
  EXPECT_THAT(summary.faults, ElementsAre("axis1: DEGRADED"));
  EXPECT_EQ(Json(summary)["good"], false);
  EXPECT_THAT(summary.text, HasSubstr("not good:\n  axis1: DEGRADED\n"));
}

}  // namespace

}  // namespace axlecast
