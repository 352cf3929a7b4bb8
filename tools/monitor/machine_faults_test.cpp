#include "tools/monitor/machine_faults.h"

#include <gmock/gmock.h>

#include "tools/monitor/one_axis.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr MonoNs kNow = 100 * kSecond;

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
              ElementsAre("axis1: its driver was never heard", "rs485-0: the bus never reported"));
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

}  // namespace
}  // namespace axlecast
