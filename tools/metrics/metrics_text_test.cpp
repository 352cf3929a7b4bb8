#include "tools/metrics/metrics_text.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <initializer_list>
#include <sstream>
#include <string>

#include "tools/metrics/busy_machine_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Returns the value of a sample in the text; empty without such a sample.
std::string ValueOf(const std::string& text, const std::string& sample) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(sample + ' ')) return line.substr(sample.size() + 1);
  }
  return "";
}

class MetricsTextTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::string Value(const std::string& sample, MonoNs now = kBusyNow) const {
    return ValueOf(MetricsText(monitor_, now, "1.2.3"), sample);
  }
  template <typename Message>
  void Hear(const std::string& channel, const Message& message) {
    monitor_.OnMessage(channel, Encoded(message), kBusyNow);
  }

  Monitor monitor_ = BusyMachine();
};

TEST_F(MetricsTextTest, NothingHeardYet) {
  const std::string text = MetricsText(Monitor(OneAxis()), kBusyNow, "1.2.3");
  EXPECT_EQ(ValueOf(text, "axlecast_build_info{version=\"1.2.3\"}"), "1");
  EXPECT_EQ(ValueOf(text, "axlecast_machine_info{machine=\"press3\"}"), "1");
  EXPECT_EQ(ValueOf(text, "axlecast_device_state{device=\"axis1\",state=\"silent\"}"), "1");
  EXPECT_EQ(ValueOf(text, "axlecast_bus_state{bus=\"rs485-0\",state=\"silent\"}"), "1");
  EXPECT_EQ(ValueOf(text, "axlecast_bridge_up"), "0");
  EXPECT_EQ(ValueOf(text, "axlecast_commands_total{outcome=\"indeterminate\"}"), "0");
  EXPECT_THAT(text, Not(HasSubstr("axlecast_device_position")));
  EXPECT_THAT(text, Not(HasSubstr("axlecast_bus_exchanges_total")));
}

TEST_F(MetricsTextTest, DevicesWithStateCountersAndPosition) {
  const std::string axis = "{device=\"axis1\"}";
  EXPECT_EQ(Value("axlecast_device_state{device=\"axis1\",state=\"online\"}"), "1");
  EXPECT_EQ(Value("axlecast_device_state{device=\"axis1\",state=\"silent\"}"), "0");
  EXPECT_EQ(Value("axlecast_device_readings_total" + axis), "5000");
  EXPECT_EQ(Value("axlecast_device_reading_errors_total{device=\"axis1\",kind=\"checksum\"}"), "7");
  EXPECT_EQ(Value("axlecast_device_last_good_timestamp_seconds" + axis), "1700000000.5");
  EXPECT_EQ(Value("axlecast_device_position_valid{device=\"axis1\"}"), "1");
  EXPECT_NEAR(std::stod(Value("axlecast_device_position_radians{device=\"axis1\"}")), 78.539816, 1e-6);
  EXPECT_NEAR(std::stod(Value("axlecast_device_speed_radians_per_second{device=\"axis1\"}")), 6.283185, 1e-6);
}

TEST_F(MetricsTextTest, ASilentDriverLeavesItsCountersAlone) {
  const MonoNs later = kBusyNow + kStaleAfter + 1;
  EXPECT_EQ(Value("axlecast_device_state{device=\"axis1\",state=\"silent\"}", later), "1");
  EXPECT_EQ(Value("axlecast_device_state{device=\"axis1\",state=\"online\"}", later), "0");
  EXPECT_EQ(Value("axlecast_device_readings_total{device=\"axis1\"}", later), "5000");
  EXPECT_EQ(Value("axlecast_device_position_radians{device=\"axis1\"}", later), "");
  EXPECT_EQ(Value("axlecast_bus_exchange_rate_hertz{bus=\"rs485-0\"}", later), "");
  EXPECT_EQ(Value("axlecast_motor_voltage_volts{device=\"gm1\"}", later), "");
  EXPECT_EQ(Value("axlecast_recorder_state{recorder=\"events\",state=\"silent\"}", later), "1");
  EXPECT_EQ(Value("axlecast_bridge_up", later), "0");
}

TEST_F(MetricsTextTest, MotorsAndCanControllers) {
  EXPECT_EQ(Value("axlecast_motor_voltage_volts{device=\"gm1\"}"), "200.5");
  EXPECT_EQ(Value("axlecast_motor_trips_total{device=\"gm1\"}"), "2");
  EXPECT_EQ(Value("axlecast_motor_tripped{device=\"gm1\"}"), "1");
  EXPECT_EQ(Value("axlecast_motor_stop_commanded{device=\"gm1\"}"), "0");
  EXPECT_EQ(Value("axlecast_bus_can_transmit_errors{bus=\"rs485-0\"}"), "8");
}

TEST_F(MetricsTextTest, WhatIsNotKnownIsAbsent) {
  motor_health_t motor = BusyMotor();
  motor.current_a = std::nanf("");
  motor.stop_coil = -1;
  Hear("MOTOR/gm1", motor);
  bus_health_t bus = BusMessage(bus_health_t::STATE_UP);
  bus.wire_limit_hz = 0;
  bus.can_tec = bus.can_rec = -1;
  Hear("BUS/rs485-0", bus);
  EXPECT_EQ(Value("axlecast_motor_voltage_volts{device=\"gm1\"}"), "200.5");
  EXPECT_EQ(Value("axlecast_motor_current_amperes{device=\"gm1\"}"), "");
  EXPECT_EQ(Value("axlecast_motor_stop_commanded{device=\"gm1\"}"), "");
  EXPECT_EQ(Value("axlecast_bus_can_receive_errors{bus=\"rs485-0\"}"), "");
  EXPECT_EQ(Value("axlecast_bus_wire_limit_hertz{bus=\"rs485-0\"}"), "");
  EXPECT_EQ(Value("axlecast_bus_utilisation_ratio{bus=\"rs485-0\"}"), "");
}

TEST_F(MetricsTextTest, ExchangeTimesAreAHistogram) {
  const std::string bucket = "axlecast_bus_exchange_seconds_bucket{bus=\"rs485-0\",le=";
  EXPECT_EQ(Value(bucket + "\"5e-05\"}"), "10");
  EXPECT_EQ(Value(bucket + "\"1e-04\"}"), "90");
  EXPECT_EQ(Value(bucket + "\"1\"}"), "99");
  EXPECT_EQ(Value(bucket + "\"+Inf\"}"), "100");
  EXPECT_EQ(Value("axlecast_bus_exchange_seconds_sum{bus=\"rs485-0\"}"), "2.5");
  EXPECT_EQ(Value("axlecast_bus_exchange_seconds_count{bus=\"rs485-0\"}"), "100");
}

TEST_F(MetricsTextTest, AHistogramThatMakesNoSenseIsLeftOut) {
  for (const auto& spoil :
       std::initializer_list<void (*)(exchange_times_t&)>{[](exchange_times_t& times) {
                                                            times.within = {10, 9, 99};
                                                          },
                                                          [](exchange_times_t& times) {
                                                            times.bound_us = {50, 50, 100};
                                                          },
                                                          [](exchange_times_t& times) { times.total = 98; },
                                                          [](exchange_times_t& times) {
                                                            times.within = {-1, 0, 0};
                                                          },
                                                          [](exchange_times_t& times) { times.sum_us = -1; },
                                                          [](exchange_times_t& times) {
                                                            times.n = 0;
                                                            times.bound_us.clear();
                                                            times.within.clear();
                                                          }}) {
    exchange_times_t times = BusyTimes();
    spoil(times);
    Hear("BUS_TIMES/rs485-0", times);
    EXPECT_EQ(Value("axlecast_bus_exchange_seconds_count{bus=\"rs485-0\"}"), "");
  }
}

TEST_F(MetricsTextTest, AlarmsWithTheirSenderAndState) {
  EXPECT_EQ(Value("axlecast_alarm{origin=\"device\",name=\"axis1\",alarm=\"battery_alarm\",severity=\"error\","
                  "state=\"live\"}"),
            "1");
  EXPECT_EQ(Value("axlecast_alarms{origin=\"device\",name=\"axis1\"}"), "3");
  EXPECT_EQ(Value("axlecast_alarms{origin=\"bridge\",name=\"bridge\"}"), "0");
  EXPECT_EQ(Value("axlecast_alarms{origin=\"recorder\",name=\"events\"}"), "") << "it has not reported yet";
}

TEST_F(MetricsTextTest, OneAlarmToldTwiceIsOneSample) {
  alarm_t alarm = BusyAlarm();
  alarm.entries[1] = alarm.entries[0];
  Hear("ALARM/axis1", alarm);
  const std::string text = MetricsText(monitor_, kBusyNow, "1.2.3");
  const std::size_t first = text.find("alarm=\"battery_alarm\"");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(text.find("alarm=\"battery_alarm\"", first + 1), std::string::npos);
}

TEST_F(MetricsTextTest, RecordersCommandsAndWhatDidNotReachUs) {
  EXPECT_EQ(Value("axlecast_recorder_state{recorder=\"events\",state=\"recording\"}"), "1");
  EXPECT_EQ(Value("axlecast_recorder_lost_messages_total{recorder=\"events\"}"), "12");
  EXPECT_EQ(Value("axlecast_recorder_free_bytes{recorder=\"events\"}"), "1000000000");
  EXPECT_EQ(Value("axlecast_commands_total{outcome=\"succeeded\"}"), "1");
  EXPECT_EQ(Value("axlecast_messages_received_total{channel=\"POSITION/axis1\"}"), "3");
  EXPECT_EQ(Value("axlecast_messages_lost_total{channel=\"POSITION/axis1\"}"), "2");
  EXPECT_EQ(Value("axlecast_messages_unusable_total"), "1");
}

// Valid readings make a bus UP whose BUS message has not come: its numbers are not known then.
TEST_F(MetricsTextTest, ABusWhoseOwnMessageIsMissingHasNoNumbers) {
  EXPECT_EQ(Value("axlecast_bus_state{bus=\"rs485-1\",state=\"up\"}"), "1");
  EXPECT_EQ(Value("axlecast_bus_exchange_rate_hertz{bus=\"rs485-1\"}"), "");
  EXPECT_EQ(Value("axlecast_bus_can_transmit_errors{bus=\"rs485-1\"}"), "");
}

// Anybody may publish names: each would be a series for ever in Prometheus.
TEST_F(MetricsTextTest, NamesThatTheFileDoesNotListAreCountedAndGetNoSeries) {
  const auto lines = [this] {
    const std::string text = MetricsText(monitor_, kBusyNow, "1.2.3");
    return std::count(text.begin(), text.end(), '\n');
  };
  const auto before = lines();
  for (int i = 0; i < 1000; ++i) {
    const std::string name = "forged-" + std::to_string(i);
    Hear("DEVICE/" + name, DeviceMessage(device_info_t::STATE_ONLINE));
    Hear("POSITION/" + name, PositionMessage(i));
    Hear("ALARM/" + name, BusyAlarm());
    Hear("BUS/" + name, BusMessage(bus_health_t::STATE_UP));
    Hear("BUS_TIMES/" + name, BusyTimes());
    Hear("RECORDER/" + name, recorder_health_t{});
    Hear("ALARM/recorder/" + name, BusyAlarm());
  }
  EXPECT_EQ(lines(), before);
  EXPECT_EQ(Value("axlecast_unlisted_senders{kind=\"device\"}"), std::to_string(MachineView::kMaxUnlisted));
  EXPECT_EQ(Value("axlecast_unlisted_senders{kind=\"bus\"}"), std::to_string(MachineView::kMaxUnlisted));
  EXPECT_EQ(Value("axlecast_unlisted_senders{kind=\"recorder\"}"), std::to_string(Monitor::kMaxRecorders));
  EXPECT_EQ(Value("axlecast_device_readings_total{device=\"axis1\"}"), "5000");
}

TEST_F(MetricsTextTest, AnotherMachineHasItsOwnSeries) {
  EXPECT_EQ(Value("axlecast_other_machine_messages_total{machine=\"press2\"}"), "3");
}

}  // namespace
}  // namespace axlecast
