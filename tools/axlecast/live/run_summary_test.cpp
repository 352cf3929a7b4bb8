#include "tools/axlecast/live/run_summary.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tools/monitor/one_axis.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr MonoNs kNow = 100 * kSecond;

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
  EXPECT_THAT(summary.faults, ElementsAre("axis1: its driver was never heard", "rs485-0: the bus never reported",
                                          "axis1: no valid position"));
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
