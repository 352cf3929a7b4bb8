#include "tools/axlecast/live/format_counts.h"

#include <gmock/gmock.h>
#include <axlecast/alarm_t.hpp>
#include <string>

#include "tools/axlecast/live/format_machine.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr MonoNs kNow = 100 * kSecond;

void SetState(MachineView& view, std::size_t axis, std::int8_t state, const std::string& reason = "",
              MonoNs now = kNow) {
  device_info_t info = DeviceMessage(state);
  info.reason = reason;
  view.OnMessage("DEVICE/axis" + std::to_string(axis), Encoded(info), now);
}

void SetBus(MachineView& view, std::size_t line, std::int8_t state, const std::string& error = "") {
  bus_health_t health = BusMessage(state);
  health.last_error = error;
  view.OnMessage("BUS/line" + std::to_string(line), Encoded(health), kNow);
}

MachineView AllGood(std::size_t axes, bool allows_unsigned = false) {
  MachineConfig machine = Axes(axes);
  machine.bridge.allow_unsigned = allows_unsigned;
  MachineView view(machine);
  for (std::size_t i = 0; i < axes; ++i) {
    SetState(view, i, device_info_t::STATE_ONLINE);
    SetBus(view, i, bus_health_t::STATE_UP);
  }
  view.OnMessage("ALARM/bridge", Encoded(alarm_t{}), kNow);
  return view;
}

void SetAlarm(MachineView& view, const std::string& sender, const char* name, std::int8_t severity) {
  alarm_t alarm{};
  alarm_entry_t& entry = alarm.entries.emplace_back();
  entry.name = name;
  entry.severity = severity;
  entry.action = "do this";
  alarm.n = 1;
  alarm.total = 1;
  view.OnMessage("ALARM/" + sender, Encoded(alarm), kNow);
}

TEST(StatusOfManyDevices, IsShortWhileAllIsGood) {
  EXPECT_EQ(StatusText(AllGood(300), kNow),
            "devices                  300: 300 ONLINE\n"
            "buses                    300: 300 UP\n"
            "alarms                   0\n"
            "bridge                   SERVING\n"
            "good: every device ONLINE, every bus UP\n");
}

TEST(StatusOfManyDevices, ShowsOnlyTheRowsThatNeedAttentionWithTheirReasons) {
  MachineView view = AllGood(300, true);
  SetState(view, 7, device_info_t::STATE_DEGRADED, "alarm over_speed");
  SetAlarm(view, "axis7", "over_speed", alarm_entry_t::SEVERITY_ERROR);
  SetAlarm(view, "axis8", "battery_warning", alarm_entry_t::SEVERITY_WARNING);
  SetAlarm(view, "axis9", "note", alarm_entry_t::SEVERITY_INFO);
  SetState(view, 42, device_info_t::STATE_OFFLINE, "no reply");
  SetState(view, 43, device_info_t::STATE_ONLINE, "", kNow - 5 * kSecond);
  SetBus(view, 42, bus_health_t::STATE_DOWN, "open /dev/ttyUSB3: no such file");
  EXPECT_EQ(StatusText(view, kNow),
            "warning: unsigned commands are obeyed (bridge: unsigned_commands: allow): anybody on the network "
            "segment can command it\n"
            "devices                  300: 297 ONLINE, 1 DEGRADED, 1 OFFLINE, 1 SILENT\n"
            "buses                    300: 299 UP, 1 DOWN\n"
            "alarms                   3: 1 error, 1 warning, 1 info\n"
            "axis7                    DEGRADED                       -  over_speed  (alarm over_speed)\n"
            "axis8                    ONLINE                         -  battery_warning\n"
            "axis42                   OFFLINE                        -    (no reply)\n"
            "axis43                   SILENT                         -    (the last message came 5.0 s ago)\n"
            "line42                   DOWN        (open /dev/ttyUSB3: no such file)\n"
            "bridge                   SERVING\n"
            "not good: devices or buses as above\n");
}

TEST(StatusOfManyDevices, CausesWithoutARowFollowAtTheEnd) {
  MachineView view = AllGood(20);
  SetAlarm(view, "bridge", "journal_fails", alarm_entry_t::SEVERITY_ERROR);
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("\nnot good:\n  bridge: journal_fails: do this\n"));
  SetState(view, 3, device_info_t::STATE_OFFLINE, "no reply");
  EXPECT_THAT(StatusText(view, kNow),
              HasSubstr("\nnot good: devices or buses as above\n  bridge: journal_fails: do this\n"));
}

TEST(StatusOfManyDevices, AllShowsEveryRowAndEachCause) {
  MachineView view = AllGood(300);
  SetState(view, 42, device_info_t::STATE_OFFLINE, "no reply");
  const std::string text = StatusText(view, kNow, StatusRows::kAll);
  EXPECT_THAT(text, StartsWith("devices                  300: 299 ONLINE, 1 OFFLINE\n"));
  EXPECT_EQ(std::ranges::count(text, '\n'), 3 + 300 + 300 + 1 + 2);
  EXPECT_THAT(text, HasSubstr("\nnot good:\n  axis42: OFFLINE (no reply)\n"));
}

TEST(StatusOfManyDevices, UpToSixteenEveryRowIsShownWithoutNumbers) {
  const std::string small = StatusText(AllGood(kMaxGoodRows), kNow);
  EXPECT_THAT(small, StartsWith("axis0                    ONLINE "));
  EXPECT_EQ(std::ranges::count(small, '\n'), 16 + 16 + 1 + 1);
  EXPECT_THAT(StatusText(AllGood(kMaxGoodRows + 1), kNow), StartsWith("devices                  17: 17 ONLINE\n"));
  EXPECT_THAT(StatusText(AllGood(1), kNow, StatusRows::kAll), StartsWith("devices                  1: 1 ONLINE\n"));
}

TEST(StatusOfManyDevices, TheJsonHasTheNumbersAndEveryRow) {
  MachineView view = AllGood(300);
  SetState(view, 42, device_info_t::STATE_STARTING);
  SetAlarm(view, "axis7", "over_speed", alarm_entry_t::SEVERITY_ERROR);
  const auto json = StatusJson(view, kNow);
  EXPECT_EQ(json["devices"].size(), 300U);
  EXPECT_EQ(json["buses"].size(), 300U);
  EXPECT_EQ(json["counts"].dump(),
            R"({"devices":{"total":300,"online":299,"degraded":0,"offline":0,"starting":1,"silent":0},)"
            R"("buses":{"total":300,"up":300,"degraded":0,"down":0,"starting":0,"silent":0},)"
            R"("hosts":{"total":0,"silent":0,"claims":0},)"
            R"("alarms":{"critical":0,"error":1,"warning":0,"info":0,"shelved":0}})");
}

TEST(CountsText, HostsHaveARowIfTheMachineNamesThem) {
  MachineCounts counts;
  counts.hosts = {.total = 3, .silent = 1, .claims = 2};
  EXPECT_THAT(CountsText(counts),
              HasSubstr("hosts                    3: 2 with a claim of the time base, 1 SILENT\n"));
  counts.hosts = {};
  EXPECT_THAT(CountsText(counts), Not(HasSubstr("hosts")));
}

}  // namespace
}  // namespace axlecast
