#include "tools/axlecast/live/status_text.h"

#include <gmock/gmock.h>

#include <axlecast/alarm_t.hpp>

#include "tools/monitor/one_axis.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

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
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("not good:\n  axis1: its driver was never heard\n"));
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

}  // namespace
}  // namespace axlecast
