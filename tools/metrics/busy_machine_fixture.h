#pragma once

#include <string>

#include "tools/monitor/monitor.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {

// A machine with samples in every family of metrics, and with texts that need escaping; for tests.
inline constexpr MonoNs kBusyNow = 100 * kSecond;

inline alarm_t BusyAlarm() {
  alarm_t alarm{};
  alarm.n = 2;
  alarm.total = 3;
  alarm.entries.resize(2);
  alarm.entries[0].code = 1;
  alarm.entries[0].name = "battery_alarm";
  alarm.entries[0].severity = alarm_entry_t::SEVERITY_ERROR;
  alarm.entries[1].code = 2;
  alarm.entries[1].name = "a \"b\" \\ \n\xff";
  return alarm;
}

inline exchange_times_t BusyTimes() {
  exchange_times_t times{};
  times.bus = "rs485-0";
  times.n = 3;
  times.bound_us = {50, 100, 1'000'000};
  times.within = {10, 90, 99};
  times.total = 100;
  times.sum_us = 2'500'000;
  return times;
}

inline motor_health_t BusyMotor() {
  motor_health_t motor{};
  motor.voltage_v = 200.5F;
  motor.current_a = 1.5F;
  motor.trip_count = 2;
  motor.flags = std::int32_t{motor_health_t::FLAG_ANALOG_VALID} | motor_health_t::FLAG_STATUS_VALID |
                motor_health_t::FLAG_TRIPPED;
  return motor;
}

inline Monitor BusyMachine() {
  static const Family kMonitors{.name = "monitors", .summary = "", .has_position = false, .operations = {}};
  MachineConfig machine = OneAxis();
  BusConfig& motors = machine.buses.emplace_back();
  motors.name = "rs485-1";
  motors.family = &kMonitors;
  motors.devices.emplace_back().name = "gm1";
  machine.recorder.logs.emplace_back().name = "events";
  machine.time.root = "plc1";
  Monitor monitor{machine};
  const auto receive = [&monitor](const std::string& channel, const auto& message) {
    monitor.OnMessage(channel, Encoded(message), kBusyNow);
  };
  device_info_t info = DeviceMessage(device_info_t::STATE_ONLINE);
  info.serial = "A\\1";
  info.good = 5000;
  info.errors[device_info_t::ERROR_CHECKSUM] = 7;
  info.last_good_utime = 1'700'000'000'500'000;
  receive("DEVICE/axis1", info);
  for (const std::int64_t seq : {0, 1, 4}) receive("POSITION/axis1", PositionMessage(seq));
  receive("DEVICE/gm1", DeviceMessage(device_info_t::STATE_DEGRADED));
  receive("MOTOR/gm1", BusyMotor());
  bus_health_t bus = BusMessage(bus_health_t::STATE_UP);
  bus.can_tec = 8;
  receive("BUS/rs485-0", bus);
  receive("BUS_TIMES/rs485-0", BusyTimes());
  receive("ALARM/axis1", BusyAlarm());
  receive("ALARM/bridge", alarm_t{});
  recorder_health_t recorder{};
  recorder.lost = 12;
  recorder.free_bytes = 1'000'000'000;
  receive("RECORDER/events", recorder);
  time_quality_t quality{};
  quality.half_width_ns = 312'000;
  receive("TIME/plc1", quality);
  command_status_t status{};
  status.state = command_status_t::STATE_SUCCEEDED;
  status.is_final = 1;
  receive("COMMAND_STATUS", status);
  receive("DEVICE/gm1", position_t{});
  ReceptionCounts reception;
  reception.machines.push_back({.id = 1, .name = "press2", .messages = 3});
  monitor.OnReception(reception);
  return monitor;
}

}  // namespace axlecast
