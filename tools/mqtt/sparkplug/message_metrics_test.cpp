#include "tools/mqtt/sparkplug/message_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tools/mqtt/sparkplug/sparkplug_fixture.h"

namespace axlecast {
namespace {

// The expected metrics are those of the table in docs/sparkplug.md.

const MetricReading* Find(const std::vector<MetricReading>& readings, std::string_view name) {
  for (const MetricReading& reading : readings) {
    if (reading.name == name) return &reading;
  }
  return nullptr;
}
SparkplugValue ValueOf(const MessageMetrics& metrics, std::string_view name) {
  const MetricReading* const reading = Find(metrics.readings, name);
  EXPECT_NE(reading, nullptr) << name;
  return reading == nullptr ? SparkplugValue() : reading->value;
}

TEST(MessageMetricsTest, APosition) {
  const auto metrics = MetricsOf("POSITION/axis1", PositionMessage(7, 12.5, kStartUtime + 999));
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->device, "axis1");
  EXPECT_EQ(metrics->timestamp_ms, kStartUtime / 1'000);
  EXPECT_EQ(ValueOf(*metrics, "Position/Value"), SparkplugValue(12.5));
  EXPECT_EQ(ValueOf(*metrics, "Position/Counts"), SparkplugValue(std::int64_t{70}));
  EXPECT_EQ(ValueOf(*metrics, "Position/Valid"), SparkplugValue(true));
  EXPECT_EQ(ValueOf(*metrics, "Position/Referenced"), SparkplugValue(false));
  EXPECT_EQ(ValueOf(*metrics, "Position/TurnsValid"), SparkplugValue(true));
  EXPECT_EQ(ValueOf(*metrics, "Position/Speed"), SparkplugValue()) << "unknown";
  EXPECT_EQ(ValueOf(*metrics, "Position/Flags"), SparkplugValue(std::uint32_t{3}));
  EXPECT_EQ(ValueOf(*metrics, "Position/Seq"), SparkplugValue(std::int64_t{7}));
  EXPECT_EQ(ValueOf(*metrics, "Position/BootId"), SparkplugValue(std::string("0000000000001234")));
  EXPECT_TRUE(Find(metrics->readings, "Position/BootId")->only_in_births);
  const MetricReading& value = *Find(metrics->readings, "Position/Value");
  EXPECT_EQ(value.type, SparkplugType::kDouble);
  EXPECT_EQ(value.properties.at(0).key, "engUnit");
  EXPECT_EQ(value.properties.at(0).value, SparkplugValue(std::string("mm")));
}

TEST(MessageMetricsTest, QualityIsGoodOnlyWithValidPositionAndTurns) {
  const auto quality = [](std::int32_t flags) {
    return Find(MetricsOf("POSITION/axis1", PositionMessage(0, 0, 0, flags))->readings, "Position/Value")->quality;
  };
  EXPECT_EQ(quality(kGoodFlags), kQualityGood);
  EXPECT_EQ(quality(position_t::FLAG_VALID), kQualityBad);
  EXPECT_EQ(quality(position_t::FLAG_TURNS_VALID), kQualityBad);
  EXPECT_EQ(quality(0), kQualityBad);
}

TEST(MessageMetricsTest, ADevice) {
  device_info_t info{};
  info.state = device_info_t::STATE_DEGRADED;
  info.model = "TS5667";
  info.serial = "bad \xff";
  info.good = 41;
  info.errors[device_info_t::ERROR_TIMEOUT] = 3;
  info.datum_epoch = 2;
  const auto metrics = MetricsOf("DEVICE/axis1", Encoded(info));
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->device_state, device_info_t::STATE_DEGRADED);
  EXPECT_EQ(ValueOf(*metrics, "State"), SparkplugValue(std::string("DEGRADED")));
  EXPECT_EQ(ValueOf(*metrics, "State/Code"), SparkplugValue(std::int32_t{2}));
  EXPECT_EQ(ValueOf(*metrics, "Model"), SparkplugValue(std::string("TS5667")));
  EXPECT_EQ(ValueOf(*metrics, "Serial"), SparkplugValue(std::string("bad \xef\xbf\xbd"))) << "a text is UTF-8";
  EXPECT_EQ(ValueOf(*metrics, "Datum/Epoch"), SparkplugValue(std::int32_t{2}));
  EXPECT_EQ(ValueOf(*metrics, "Reading/Good"), SparkplugValue(std::int64_t{41}));
  EXPECT_EQ(ValueOf(*metrics, "Reading/Errors/timeout"), SparkplugValue(std::int64_t{3}));
  EXPECT_EQ(ValueOf(*metrics, "Reading/Errors/checksum"), SparkplugValue(std::int64_t{0}));
}

TEST(MessageMetricsTest, Alarms) {
  const auto metrics = MetricsOf("ALARM/axis1", AlarmMessage({"overheat"}, 5'000));
  ASSERT_TRUE(metrics);
  EXPECT_TRUE(metrics->is_all_alarms);
  EXPECT_EQ(ValueOf(*metrics, "Alarm/Total"), SparkplugValue(std::int32_t{1}));
  EXPECT_EQ(ValueOf(*metrics, "Alarm/Worst"), SparkplugValue(std::string("error")));
  EXPECT_EQ(ValueOf(*metrics, "Alarm/overheat/Active"), SparkplugValue(true));
  const MetricReading& alarm = *Find(metrics->readings, "Alarm/overheat/Active");
  EXPECT_EQ(alarm.properties.at(0).key, "severity");
  EXPECT_EQ(alarm.properties.at(1).value, SparkplugValue(std::string("act")));
}

TEST(MessageMetricsTest, AnAlarmIsActiveByItsState) {
  const auto active = [](std::int8_t state) {
    return ValueOf(*MetricsOf("ALARM/axis1", AlarmMessage({"a"}, 0, state)), "Alarm/a/Active");
  };
  EXPECT_EQ(active(alarm_entry_t::STATE_DEVICE_LATCHED), SparkplugValue(true));
  EXPECT_EQ(active(alarm_entry_t::STATE_DRIVER_LATCHED), SparkplugValue(true));
  EXPECT_EQ(active(alarm_entry_t::STATE_UNACKNOWLEDGED), SparkplugValue(false));
  EXPECT_EQ(active(alarm_entry_t::STATE_SHELVED), SparkplugValue(false));
  EXPECT_EQ(active(alarm_entry_t::STATE_UNKNOWN), SparkplugValue());
}

TEST(MessageMetricsTest, AlarmsThatAreNotListedAreAbsentUnlessTheListIsCut) {
  const auto known = DeviceMetrics(SparkplugMachine().buses[0], SparkplugMachine().buses[0].devices[0]);
  const auto listed = MetricsOf("ALARM/axis1", AlarmMessage({"device_offline"}, 0))->readings;
  const auto absent = AbsentAlarms(known, listed);
  EXPECT_EQ(Find(absent, "Alarm/device_offline/Active"), nullptr);
  ASSERT_NE(Find(absent, "Alarm/reference_lost/Active"), nullptr);
  EXPECT_EQ(Find(absent, "Alarm/reference_lost/Active")->value, SparkplugValue(false));
  alarm_t cut{};
  cut.total = 1;
  EXPECT_FALSE(MetricsOf("ALARM/axis1", Encoded(cut))->is_all_alarms);
}

TEST(MessageMetricsTest, AMotor) {
  motor_health_t motor{};
  motor.voltage_v = 200.5F;
  motor.current_a = std::nanf("");
  motor.accel_mps2[1] = 1.5F;
  motor.trip_count = 4;
  motor.stop_coil = -1;
  const auto metrics = MetricsOf("MOTOR/gm1", Encoded(motor));
  ASSERT_TRUE(metrics);
  EXPECT_EQ(ValueOf(*metrics, "Motor/Voltage"), SparkplugValue(200.5F));
  EXPECT_EQ(ValueOf(*metrics, "Motor/Current"), SparkplugValue());
  EXPECT_EQ(ValueOf(*metrics, "Motor/Accel/Y"), SparkplugValue(1.5F));
  EXPECT_EQ(ValueOf(*metrics, "Motor/TripCount"), SparkplugValue(std::int32_t{4}));
  EXPECT_EQ(ValueOf(*metrics, "Motor/StopCoil"), SparkplugValue());
}

TEST(MessageMetricsTest, EventsAreTextsOfTheNode) {
  command_status_t status{};
  status.device = "axis1";
  status.operation = "zero";
  const auto command = MetricsOf("COMMAND_STATUS/axis1", Encoded(status));
  ASSERT_TRUE(command);
  EXPECT_EQ(command->device, "");
  const MetricReading* const reading = Find(command->readings, "Command/axis1");
  ASSERT_NE(reading, nullptr);
  EXPECT_TRUE(reading->is_transient);
  const auto json = nlohmann::json::parse(std::get<std::string>(reading->value));
  EXPECT_EQ(json.at("operation"), "zero");
  EXPECT_FALSE(json.contains("sig"));
  EXPECT_FALSE(json.contains("token"));
  const auto trip = MetricsOf("TRIP/gm1", Encoded(trip_log_t{}));
  ASSERT_TRUE(trip);
  EXPECT_NE(Find(trip->readings, "Trip/gm1"), nullptr);
}

TEST(MessageMetricsTest, ABusBelongsToTheNode) {
  bus_health_t health{};
  health.bus = "rs485-0";
  health.state = bus_health_t::STATE_UP;
  const auto metrics = MetricsOf("BUS/rs485-0", Encoded(health));
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->device, "");
  EXPECT_EQ(ValueOf(*metrics, "Bus/rs485-0/State"), SparkplugValue(std::string("UP")));
}

TEST(MessageMetricsTest, OtherChannelsAndMessagesHaveNone) {
  EXPECT_FALSE(MetricsOf("LIMITS/axis1", PositionMessage(0, 0, 0)));
  EXPECT_FALSE(MetricsOf("POSITION/axis1", DeviceMessage(1, 0)));
  EXPECT_FALSE(MetricsOf("POSITION/axis1", {}));
  EXPECT_FALSE(MetricsOf("TRIP/axis1", PositionMessage(0, 0, 0)));
  EXPECT_FALSE(FindMetricChannel("RECORDER/log"));
  EXPECT_FALSE(FindMetricChannel("POSITION"));
}

// A message never has a metric that the birth of its device does not have.
TEST(MessageMetricsTest, BirthsHaveTheMetricsOfEveryMessage) {
  const MachineConfig machine = SparkplugMachine();
  const auto device = DeviceMetrics(machine.buses[0], machine.buses[0].devices[0]);
  for (const MetricReading& metric : device) {
    const bool is_alarm = metric.name.ends_with("/Active");
    EXPECT_EQ(metric.value, is_alarm ? SparkplugValue(false) : SparkplugValue()) << metric.name;
  }
  for (const auto& metrics :
       {MetricsOf("POSITION/axis1", PositionMessage(0, 0, 0)), MetricsOf("DEVICE/axis1", DeviceMessage(1, 0)),
        MetricsOf("ALARM/axis1", AlarmMessage({"device_offline"}, 0))}) {
    for (const MetricReading& reading : metrics->readings) {
      const MetricReading* const known = Find(device, reading.name);
      ASSERT_NE(known, nullptr) << reading.name;
      EXPECT_EQ(known->type, reading.type) << reading.name;
    }
  }
  const auto node = NodeMetrics(machine);
  EXPECT_NE(Find(node, "Command/axis2"), nullptr);
  EXPECT_NE(Find(node, "Bus/rs485-0/State"), nullptr);
}

TEST(MessageMetricsTest, BirthsHaveTheAlarmsOfTheFamily) {
  MachineConfig machine = SparkplugMachine();
  Family family;
  family.alarms = [](const DeviceConfig& device) {
    return std::vector<AlarmSpec>{
        {0x100, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_ERROR, device.name.c_str(), "act"}};
  };
  machine.buses[0].family = &family;
  const auto metrics = DeviceMetrics(machine.buses[0], machine.buses[0].devices[1]);
  const MetricReading* const alarm = Find(metrics, "Alarm/axis2/Active");
  ASSERT_NE(alarm, nullptr);
  EXPECT_EQ(alarm->value, SparkplugValue(false));
  EXPECT_EQ(alarm->properties.at(0).value, SparkplugValue(std::string("error")));
  EXPECT_EQ(alarm->properties.at(1).value, SparkplugValue(std::string("act")));
}

TEST(MessageMetricsTest, NoTwoNamesDifferOnlyInCase) {
  const MachineConfig machine = SparkplugMachine();
  for (const auto& metrics : {DeviceMetrics(machine.buses[0], machine.buses[0].devices[0]), NodeMetrics(machine)}) {
    std::set<std::string> names;
    for (const MetricReading& metric : metrics) {
      std::string name = metric.name;
      std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
      EXPECT_TRUE(names.insert(name).second) << name;
    }
  }
}

}  // namespace
}  // namespace axlecast
