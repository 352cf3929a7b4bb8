#include "tools/web/web_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/messages/json/message_json.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kUtime = 1'790'000'000'000'000;
constexpr MonoNs kMono = 100 * kSecond;

class WebFramesTest : public ::testing::Test {
 protected:
  template <typename Message>
  void Hear(const std::string& channel, const Message& message) {
    monitor_.OnMessage(channel, Encoded(message), kMono);
  }
  [[nodiscard]] Json State(MonoNs later = 0) const {
    return Json::parse(StateFrame(monitor_, {kMono + later, kUtime + later / kMicrosecond}));
  }
  [[nodiscard]] Json Device(MonoNs later = 0) const { return State(later)["devices"][0]; }

  MachineConfig machine_ = OneAxis();
  Monitor monitor_{machine_};
};

TEST_F(WebFramesTest, StateSaysWhatIsKnownOfADevice) {
  EXPECT_EQ(Device()["state"], nullptr);
  EXPECT_EQ(Device()["reading"], nullptr);
  EXPECT_EQ(Device()["heard_utime"], nullptr);
  device_info_t info = DeviceMessage(device_info_t::STATE_DEGRADED);
  info.reason = "battery";
  info.errors[device_info_t::ERROR_CHECKSUM] = 3;
  info.max_age_us = 5000;
  Hear("DEVICE/axis1", info);
  Hear("POSITION/axis1", PositionMessage(0));
  const Json device = Device(kMillisecond);
  EXPECT_EQ(device["state"], "DEGRADED");
  EXPECT_EQ(device["reason"], "battery");
  EXPECT_EQ(device["errors"], Json({{"checksum", 3}}));
  EXPECT_EQ(device["heard_utime"], kUtime);
  const Json reading = device["reading"];
  EXPECT_EQ(reading["value"], 62.5);
  EXPECT_EQ(reading["unit"], "mm");
  EXPECT_EQ(reading["turns"], 12.5);
  EXPECT_NEAR(reading["speed_rpm"].get<double>(), 60, 1e-9);
  EXPECT_EQ(reading["flags"], Json({"valid", "speed_valid"}));
  EXPECT_EQ(reading["age_us"], 1000);
  EXPECT_EQ(reading["stale"], false);
}

TEST_F(WebFramesTest, StateTellsWhatIsOldOrSilent) {
  device_info_t info = DeviceMessage(device_info_t::STATE_ONLINE);
  info.max_age_us = 5000;
  Hear("DEVICE/axis1", info);
  Hear("POSITION/axis1", PositionMessage(0));
  EXPECT_EQ(Device(6 * kMillisecond)["reading"]["stale"], true);
  EXPECT_EQ(Device(6 * kMillisecond)["state"], "ONLINE");
  EXPECT_EQ(Device(3 * kSecond)["state"], nullptr);
  EXPECT_EQ(Device(3 * kSecond)["reading"]["stale"], true);
}

TEST_F(WebFramesTest, StateShowsNoValueWhereThereIsNone) {
  position_t position = PositionMessage(0);
  position.flags = 0;
  Hear("POSITION/axis1", position);
  const Json reading = Device()["reading"];
  EXPECT_EQ(reading["valid"], false);
  for (const char* name : {"value", "turns", "angle_deg", "speed_rpm"}) EXPECT_EQ(reading[name], nullptr) << name;
}

TEST_F(WebFramesTest, StateSaysWhatIsKnownOfAMonitor) {
  motor_health_t motor{};
  motor.voltage_v = 200;
  motor.current_a = NAN;
  motor.trip_count = 2;
  motor.status_bits = 0x21;
  motor.trip_factor[0] = 0x40;
  motor.stop_coil = -1;
  motor.mains_hz = 50;
  motor.flags = std::int32_t{motor_health_t::FLAG_ANALOG_VALID} | motor_health_t::FLAG_TRIPPED;
  Hear("DEVICE/gm1", DeviceMessage(device_info_t::STATE_ONLINE));
  Hear("MOTOR/gm1", motor);
  const Json state = State();
  ASSERT_EQ(state["devices"].size(), 2U);
  const Json& device = state["devices"][1];
  EXPECT_EQ(device["device"], "gm1");
  const Json reading = device["reading"];
  EXPECT_EQ(reading["voltage_v"], 200);
  EXPECT_EQ(reading["current_a"], nullptr);
  EXPECT_EQ(reading["valid"], false);  // the status was not read
  EXPECT_EQ(reading["tripped"], true);
  EXPECT_EQ(reading["status"], Json({"power upper A", "overheat"}));
  EXPECT_EQ(reading["status_names"], Json({"power_upper_a", "overheat"}));
  EXPECT_EQ(reading["trip_factors"][0], Json({"excessive shock"}));
  EXPECT_EQ(reading["trip_factor_names"][0], Json({"excessive_shock"}));
  EXPECT_EQ(reading["stop_coil"], nullptr);
}

TEST_F(WebFramesTest, StateShowsHowFarAMotorIsFromItsTripLimits) {
  Hear("DEVICE/gm1", DeviceMessage(device_info_t::STATE_ONLINE));
  motor_health_t motor{};
  motor.power_w = 250;
  motor.temperature_c = 45;
  motor.flags = motor_health_t::FLAG_ANALOG_VALID;
  Hear("MOTOR/gm1", motor);
  EXPECT_EQ(State()["devices"][1]["limits"], nullptr) << "not received yet";
  EXPECT_FALSE(Device().contains("limits")) << "an encoder has none";
  motor_limits_t limits{};
  limits.utime = kUtime - 1;
  limits.power_upper_w[0] = 300;
  limits.power_upper_w[1] = NAN;
  Hear("LIMITS/gm1", limits);
  const Json shown = State(kMillisecond)["devices"][1]["limits"];
  EXPECT_EQ(shown["utime"], kUtime - 1);
  EXPECT_EQ(shown["heard_utime"], kUtime);
  ASSERT_EQ(shown["margins"].size(), 6U);
  EXPECT_EQ(shown["margins"][0],
            Json({{"name", "power_upper_a"}, {"unit", "W"}, {"measured", 250}, {"limit", 300}, {"margin", 50}}));
  EXPECT_EQ(shown["margins"][1]["limit"], nullptr) << "not read yet";
  EXPECT_EQ(shown["margins"][4]["limit"], 0) << "never trips";
  EXPECT_EQ(shown["margins"][4]["margin"], nullptr);
}

TEST_F(WebFramesTest, StateSaysWhatIsKnownOfBusesAndRecorders) {
  bus_health_t health = BusMessage(bus_health_t::STATE_UP);
  health.errors[0] = 5;
  health.exchange_us[1] = 60;
  health.exchange_us[3] = NAN;
  health.can_tec = -1;
  Hear("BUS/rs485-0", health);
  recorder_health_t recorder{};
  recorder.name = "main";
  recorder.state = recorder_health_t::STATE_DISK_FULL;
  recorder.lost = 7;
  recorder.n_senders = 1;
  recorder.senders.push_back({});
  recorder.senders[0].sender = "10.0.0.2:5000";
  recorder.senders[0].lost = 7;
  Hear("RECORDER/main", recorder);
  const Json state = State();
  EXPECT_EQ(state["utime"], kUtime);
  const Json& bus = state["buses"][0];
  EXPECT_EQ(bus["state"], "UP");
  EXPECT_EQ(bus["errors"], Json({{"timeout", 5}}));
  EXPECT_EQ(bus["exchange_us"]["p50"], 60);
  EXPECT_EQ(bus["exchange_us"]["max"], nullptr);
  EXPECT_EQ(bus["can_tec"], nullptr);
  EXPECT_EQ(state["recorders"][0]["state"], "DISK_FULL");
  EXPECT_EQ(state["recorders"][0]["senders"][0]["lost"], 7);
  EXPECT_EQ(State(kStaleAfter + 1)["recorders"][0]["state"], nullptr);
  recorder.state = recorder_health_t::STATE_STOPPING;
  Hear("RECORDER/main", recorder);
  EXPECT_EQ(State()["recorders"][0]["state"], "STOPPING");
  EXPECT_EQ(State(kStaleAfter + 1)["recorders"][0]["state"], "ENDED")
      << "its last message was that it was stopping";
  EXPECT_EQ(state["bridge"]["serves"], false);
}

TEST_F(WebFramesTest, ATripHoldsItsCurves) {
  trip_log_t trip{};
  trip.device = "gm1";
  trip.trip_count = 4;
  trip.factor_bits = 0x03;
  trip.interval_us = 100'000;
  trip.not_after_utime = kUtime;
  trip.valid_mask = 0x03;
  trip.samples[1][19] = 8.5F;
  const Json frame = Json::parse(TripFrame(trip));
  EXPECT_EQ(frame["factors"], Json({"power upper A", "power upper B"}));
  EXPECT_EQ(frame["factor_names"], Json({"power_upper_a", "power_upper_b"}));
  EXPECT_EQ(frame["not_before_utime"], nullptr);
  EXPECT_EQ(frame["not_after_utime"], kUtime);
  ASSERT_EQ(frame["samples"].size(), 7U);
  EXPECT_EQ(frame["samples"][1][19], 8.5);
  EXPECT_EQ(frame["samples"][2], nullptr);
  EXPECT_EQ(frame["quantities"][1], Json({{"name", "current_a"}, {"unit", "A"}}));
}

// Where a message has a number with a name behind it, a frame has the name alone, and it is the same.
TEST_F(WebFramesTest, NamesAreThoseOfTheMessagesJson) {
  const auto all_bits = static_cast<std::int32_t>((1U << 15U) - 1);
  position_t position = PositionMessage(0);
  position.flags = all_bits;
  for (std::int8_t unit = 0; unit < 8; ++unit) {
    position.unit = unit;
    Hear("POSITION/axis1", position);
    EXPECT_EQ(Device()["reading"]["unit"], Json(ToJson(position).at("unit_name")));
  }
  EXPECT_EQ(Device()["reading"]["flags"], Json(ToJson(position).at("flag_names")));
  for (std::int8_t state = 0; state < 4; ++state) {
    const device_info_t info = DeviceMessage(state);
    Hear("DEVICE/axis1", info);
    Hear("BUS/rs485-0", BusMessage(state));
    EXPECT_EQ(Device()["state"], Json(ToJson(info).at("state_name")));
    EXPECT_EQ(State()["buses"][0]["state"], Json(ToJson(BusMessage(state)).at("state_name")));
  }
  device_info_t info = DeviceMessage(0);
  std::fill(std::begin(info.errors), std::end(info.errors), 1);
  Hear("DEVICE/axis1", info);
  EXPECT_EQ(Device()["errors"], Json(ToJson(info).at("errors_by_name")));
  for (std::int8_t state = 0; state < 5; ++state) {
    recorder_health_t recorder{};
    recorder.state = state;
    Hear("RECORDER/main", recorder);
    EXPECT_EQ(State()["recorders"][0]["state"], Json(ToJson(recorder).at("state_name")));
  }
}

TEST_F(WebFramesTest, NamesOfAlarmsAndCommandsAreThoseOfTheMessagesJson) {
  for (std::int8_t number = 0; number < 6; ++number) {
    alarm_t alarm{};
    alarm.n = 1;
    alarm.entries.resize(1);
    alarm_entry_t& entry = alarm.entries[0];
    entry.state = entry.source = number;
    entry.severity = static_cast<std::int8_t>(number % 4);
    AlarmView view;
    view.On(alarm, kMono);
    const Json shown = Json::parse(AlarmsFrame("axis1", view, 0, {}))["entries"][0];
    for (const char* name : {"state", "source", "severity"}) {
      EXPECT_EQ(shown[name], Json(ToJson(entry).at(std::string(name) + "_name"))) << name << ' ' << int{number};
    }
  }
  for (std::int8_t number = 1; number < 36; ++number) {
    command_status_t status{};
    status.state = static_cast<std::int8_t>(number % 10);
    status.reason_code = number;
    const Json shown = Json::parse(CommandFrame(status));
    EXPECT_EQ(shown["state"], Json(ToJson(status).at("state_name")));
    EXPECT_EQ(shown["reason"], Json(ToJson(status).at("reason_name")));
  }
}

TEST_F(WebFramesTest, ACommandHoldsItsOutcome) {
  command_status_t status{};
  status.id[15] = 0xab;
  status.device = "axis1";
  status.operation = "zero";
  status.state = command_status_t::STATE_REJECTED;
  status.is_final = 1;
  status.reason_code = command_status_t::REASON_NO_PERMIT;
  status.n_changes = 1;
  status.changes.push_back({});
  status.changes[0].key = "counts";
  const Json frame = Json::parse(CommandFrame(status));
  EXPECT_EQ(frame["id"], "000000000000000000000000000000ab");
  EXPECT_EQ(frame["state"], "rejected");
  EXPECT_EQ(frame["reason"], "no_permit");
  EXPECT_EQ(frame["is_final"], true);
  EXPECT_EQ(frame["started_utime"], nullptr);
  EXPECT_EQ(frame["changes"][0]["key"], "counts");
}

TEST_F(WebFramesTest, SamplesAreNumbersThatKeepTheirDigits) {
  SampleHistory history(3, 10);
  history.Add(kUtime, std::array<double, 3>{123456.7891, 1e-9, -0.5});
  history.Add(kUtime + 10'001, std::array<double, 3>{NAN, INFINITY, 1e20});
  DeviceView device;
  const Json frame = Json::parse(SamplesFrame("axis1", ColumnsOf(device, position_t::UNIT_MM), history, 0, 2, 5));
  EXPECT_EQ(frame["t0_utime"], kUtime);
  EXPECT_EQ(frame["dt_us"], Json({0, 10'001}));
  EXPECT_EQ(frame["columns"]["value"], Json({123456.7891, nullptr}));
  EXPECT_EQ(frame["columns"]["turns"], Json({1e-9, nullptr}));
  EXPECT_EQ(frame["columns"]["speed_rpm"], Json({-0.5, 1e20}));
  EXPECT_EQ(frame["dropped"], 5);
}

TEST_F(WebFramesTest, TextThatIsNoUtf8IsMended) {
  EXPECT_EQ(Json::parse(ErrorFrame("a\xff\"b"))["text"], "a\xef\xbf\xbd\"b");
}

TEST_F(WebFramesTest, TrendIsTheLastTwoMinutesOfAMotorsPowerOnceASecond) {
  DeviceView motor;
  motor.has_position = false;
  SampleHistory history(7, 10'000);
  for (std::int64_t i = 0; i < 3000; ++i) {  // 300 s at 10 Hz
    const auto power = i == 2990 ? NAN : static_cast<double>(i);
    history.Add(kUtime + i * 100'000, std::array<double, 7>{0, 0, power, 0, 0, 0, 0});
  }
  const Json trend = Json::parse(TrendFrame("gm1", ColumnsOf(motor, 0), history, kUtime + 300'000'000));
  EXPECT_EQ(trend["device"], "gm1");
  EXPECT_EQ(trend["column"], "power_w");
  ASSERT_EQ(trend["utimes"].size(), 120U);
  EXPECT_EQ(trend["utimes"][0], kUtime + 180'000'000);
  EXPECT_EQ(trend["values"][0], 1800);
  EXPECT_EQ(trend["values"][119], nullptr) << "not known";
}

}  // namespace
}  // namespace axlecast
