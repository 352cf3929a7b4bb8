#include "tools/axlecast/live/table.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <axlecast/alarm_t.hpp>

#include "core/base/text.h"
#include "tools/monitor/one_axis.h"

namespace axlecast {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr MonoNs kNow = 100 * kSecond;

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

}  // namespace
}  // namespace axlecast
