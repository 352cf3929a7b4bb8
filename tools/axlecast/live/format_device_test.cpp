#include <gmock/gmock.h>
#include <limits>

#include "core/base/text.h"
#include "tools/axlecast/common/test_monitor.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/axlecast/live/format_machine.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr MonoNs kNow = 100 * kSecond;

motor_health_t Motor(std::int64_t seq = 0) {
  motor_health_t motor{};
  motor.boot_id = 7;
  motor.seq = seq;
  motor.voltage_v = 230.1F;
  motor.current_a = 1.5F;
  motor.power_w = 250;
  motor.temperature_c = 45;
  motor.accel_mps2[2] = 9.81F;
  motor.trip_count = 3;
  motor.stop_coil = 0;
  motor.logged_in = 1;
  motor.mains_hz = 50;
  motor.flags = std::int32_t{motor_health_t::FLAG_ANALOG_VALID} | motor_health_t::FLAG_STATUS_VALID;
  return motor;
}

motor_health_t Tripped() {
  motor_health_t motor = Motor();
  motor.status_bits = 0x22;
  motor.trip_factor[0] = 0x22;
  motor.trip_factor[2] = 0x40;
  motor.stop_coil = 1;
  return motor;
}

MachineView Monitor(const motor_health_t& motor, std::int8_t state = device_info_t::STATE_ONLINE) {
  MachineView view(OneAxis(&ParameterFamily()));
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(state)), kNow);
  view.OnMessage("BUS/rs485-0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  view.OnMessage("MOTOR/axis1", Encoded(motor), kNow);
  return view;
}

TEST(MotorText, QuantitiesAndStatus) {
  EXPECT_EQ(MotorQuantities(Motor()), "230.1 V, 1.500 A, 250.0 W, 45.0 degC, 9.81 m/s2");
  EXPECT_EQ(MotorValueText(Motor()), "250.0 W 45.0 degC");
  EXPECT_EQ(MotorStatusText(Motor()), "no trip, no stop commanded, logged in, 50 Hz mains");
  EXPECT_EQ(MotorStatusText(Tripped()), "power upper B, overheat, stop commanded, logged in, 50 Hz mains");
}

TEST(MotorText, WhatWasNotReadIsADash) {
  motor_health_t motor = Motor();
  motor.flags = 0;
  EXPECT_EQ(MotorQuantities(motor), "- V, - A, - W, - degC, - m/s2");
  EXPECT_EQ(MotorStatusText(motor), "status not read yet");
  motor = Motor();
  motor.power_w = std::numeric_limits<float>::quiet_NaN();
  motor.stop_coil = motor.logged_in = -1;
  motor.mains_hz = 0;
  EXPECT_EQ(MotorValueText(motor), "- W 45.0 degC");
  EXPECT_EQ(MotorStatusText(motor), "no trip");
}

TEST(MotorRows, AMotorHasALineOfQuantitiesAndOneOfStatus) {
  std::vector<std::string> lines = {MotorHeading()};
  const MachineView view = Monitor(Motor());
  AddMotorRows(view.devices()[0], kNow + kSecond, lines);
  EXPECT_THAT(lines, ElementsAre("MOTOR        STATE           V        A        W    degC    m/s2  TRIPS   AGE s",
                                 "axis1        ONLINE      230.1    1.500    250.0    45.0    9.81      3     1.0",
                                 "  no trip, no stop commanded, logged in, 50 Hz mains"));
}

TEST(MotorRows, BeforeTheFirstReadingThereIsNoValue) {
  MachineView view(OneAxis(&ParameterFamily()));
  device_info_t offline = DeviceMessage(device_info_t::STATE_OFFLINE);
  offline.reason = "no answer";
  view.OnMessage("DEVICE/axis1", Encoded(offline), kNow);
  std::vector<std::string> lines;
  AddMotorRows(view.devices()[0], kNow, lines);
  EXPECT_THAT(lines, ElementsAre(StartsWith("axis1        OFFLINE         -"), "  no answer"));
}

TEST(MotorRows, StandInTheTableWithinItsWidth) {
  motor_health_t absurd = Motor();
  absurd.status_bits = -1;
  absurd.trip_count = INT32_MIN;
  absurd.voltage_v = std::numeric_limits<float>::max();
  MachineView view = Monitor(absurd);
  motor_limits_t limits{};
  for (float* limit :
       {&limits.power_upper_w[0], &limits.power_upper_w[1], &limits.power_lower_w[0], &limits.overheat_c}) {
    *limit = std::numeric_limits<float>::max();
  }
  view.OnMessage("LIMITS/axis1", Encoded(limits), kNow);
  const std::vector<std::string> lines = RenderTable(view, kNow, kSecond, {});
  for (const std::string& line : lines) EXPECT_EQ(Clip(line, kTableWidth), line);
  EXPECT_THAT(lines, ::testing::Contains(MotorHeading()));
}

motor_limits_t Limits() {
  motor_limits_t limits{};
  limits.power_upper_w[0] = 300;
  limits.power_upper_w[1] = 240;
  limits.power_lower_w[0] = 100;
  limits.overheat_c = std::numeric_limits<float>::quiet_NaN();
  limits.shock_mps2 = 50;
  return limits;
}

TEST(MotorLimits, EachIsShownWithTheReadingAndWhatIsLeft) {
  MachineView view = Monitor(Motor());
  EXPECT_EQ(MarginsText(view.devices()[0]), "");
  EXPECT_THAT(InfoText(view.devices()[0], kNow), HasSubstr("trip limits       not received yet"));
  EXPECT_TRUE(InfoJson(view.devices()[0]).at("limits").is_null());
  EXPECT_TRUE(InfoJson(view.devices()[0]).at("margins").is_null());
  view.OnMessage("LIMITS/axis1", Encoded(Limits()), kNow);
  const DeviceView& device = view.devices()[0];
  EXPECT_EQ(
      MarginsText(device),
      "to trip: power upper A 50.0 W, power upper B -10.0 W, power lower A 150.0 W, excessive shock 40.19 m/s2");
  EXPECT_THAT(LimitTexts(device), ElementsAre("power upper A above 300.0 W: now 250.0 W, 50.0 W left",
                                              "power upper B above 240.0 W: now 250.0 W, 10.0 W beyond",
                                              "power lower A below 100.0 W: now 250.0 W, 150.0 W left",
                                              "power lower B off", "overheat not read yet",
                                              "excessive shock above 50.00 m/s2: now 9.81 m/s2, 40.19 m/s2 left"));
  EXPECT_THAT(InfoText(device, kNow), HasSubstr("\ntrip limit        power upper A above 300.0 W: now 250.0 W"));
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("\n                         to trip: power upper A 50.0 W"));
  for (const nlohmann::ordered_json& json : {InfoJson(device), StatusJson(view, kNow).at("devices").at(0)}) {
    EXPECT_EQ(json.at("limits").at("power_upper_w").at(0), 300);
    EXPECT_EQ(json.at("margins").at(0).at("margin"), 50);
    EXPECT_TRUE(json.at("margins").at(3).at("margin").is_null());
  }
  EXPECT_THAT(RenderTable(view, kNow, kSecond, {}),
              ::testing::Contains(StartsWith("  to trip: power upper A 50.0 W")));
}

TEST(MotorSummary, AMonitorIsGoodWithReadingsOfBothHalves) {
  const RunSummary good = Summarize(Monitor(Motor()), {}, kNow, 10 * kSecond);
  EXPECT_THAT(good.faults, IsEmpty());
  EXPECT_THAT(good.text, HasSubstr("250.0 W 45.0 degC"));
  EXPECT_THAT(good.json, HasSubstr("\"trip_count\":3"));
  EXPECT_THAT(good.json, ::testing::Not(HasSubstr("\"turns\"")));

  motor_health_t half = Motor();
  half.flags = motor_health_t::FLAG_STATUS_VALID;
  EXPECT_THAT(Summarize(Monitor(half), {}, kNow, 10 * kSecond).faults, ElementsAre("axis1: no valid reading"));
}

TEST(MotorSummary, LostReadingsAreCounted) {
  MachineView view = Monitor(Motor(0));
  view.OnMessage("MOTOR/axis1", Encoded(Motor(3)), kNow);
  EXPECT_THAT(Summarize(view, {}, kNow, 10 * kSecond).faults,
              ElementsAre("axis1: 2 readings lost on the way here"));
}

TEST(MotorStatus, TextAndJsonShowTheMotor) {
  const MachineView view = Monitor(Tripped());
  EXPECT_THAT(StatusText(view, kNow), HasSubstr("250.0 W 45.0 degC"));
  EXPECT_EQ(StatusJson(view, kNow).at("devices").at(0).at("motor").at("status_bits"), 0x22);
  const std::string info = InfoText(view.devices()[0], kNow);
  EXPECT_THAT(info, HasSubstr("power upper B, overheat, stop commanded"));
  EXPECT_THAT(info, HasSubstr("trip 1            power upper B, overheat (newest)"));
  EXPECT_THAT(info, HasSubstr("trip 3            excessive shock\n"));
  EXPECT_THAT(info, ::testing::Not(HasSubstr("counts per turn")));
  EXPECT_TRUE(InfoJson(view.devices()[0]).contains("motor"));
}

// A monitor that answers counts as received when a reading arrived; one that does not answer, when its state arrived.
TEST(MonitorHeard, NeedsAReadingOfWhatAnswers) {
  MachineView view(OneAxis(&ParameterFamily()));
  view.OnMessage("BUS/rs485-0", Encoded(BusMessage(bus_health_t::STATE_UP)), kNow);
  view.OnMessage("DEVICE/axis1", Encoded(DeviceMessage(device_info_t::STATE_ONLINE)), kNow);
  EXPECT_FALSE(view.AllReceived());
  view.OnMessage("MOTOR/axis1", Encoded(Motor()), kNow);
  EXPECT_TRUE(view.AllReceived());
  EXPECT_TRUE(Monitor(Motor(), device_info_t::STATE_OFFLINE).AllReceived());
}

TEST(MonitorHeard, AnEncodersMessagesAreNotItsOwn) {
  MachineView view = Monitor(Motor());
  view.OnMessage("POSITION/axis1", Encoded(PositionMessage(0)), kNow);
  EXPECT_FALSE(view.devices()[0].position);
  EXPECT_EQ(view.devices()[0].readings.received(), 1);
}

}  // namespace

}  // namespace axlecast
