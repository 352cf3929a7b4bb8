#include "tools/metrics/metrics_text.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

#include "core/device/reading.h"
#include "tools/metrics/exposition.h"

namespace axlecast {
namespace {

using Type = Exposition::Type;

// device_info_t STATE_*, and "silent" without messages of its driver.
constexpr std::array<std::string_view, 5> kStates = {"starting", "online", "degraded", "offline", "silent"};

// Returns true if the newest reading is still current.
bool Answers(const DeviceView& device, MonoNs now) {
  const auto state = device.State(now);
  return state == device_info_t::STATE_ONLINE || state == device_info_t::STATE_DEGRADED;
}

template <typename Value>
void Each(Exposition& out, const MachineView& machine, Value value) {
  for (const DeviceView& device : machine.devices()) {
    if (device.listed && device.info) out.Add({{"device", device.name}}, value(*device.info));
  }
}

void AddInfo(Exposition& out, const MachineView& machine) {
  out.Family("axlecast_device_info", Type::kGauge, "Identity of a device; always 1.");
  for (const DeviceView& device : machine.devices()) {
    if (!device.listed || !device.info) continue;
    const device_info_t& info = *device.info;
    out.Add({{"device", device.name},
             {"bus", device.bus},
             {"family", info.family},
             {"model", info.model},
             {"serial", info.serial},
             {"firmware", info.firmware}},
            std::int64_t{1});
  }
}

void AddErrors(Exposition& out, const MachineView& machine) {
  out.Family("axlecast_device_reading_errors_total", Type::kCounter,
             "Readings that failed since the driver started, by kind.");
  for (const DeviceView& device : machine.devices()) {
    if (!device.listed || !device.info) continue;
    for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
      out.Add({{"device", device.name}, {"kind", ErrorName(static_cast<ErrorKind>(kind))}},
              device.info->errors[kind]);
    }
  }
}

template <typename Value>
void EachPosition(Exposition& out, const MachineView& machine, MonoNs now, Value value) {
  for (const DeviceView& device : machine.devices()) {
    if (!device.listed || !device.position || !Answers(device, now)) continue;
    const double number = value(device);
    if (!std::isnan(number)) out.Add({{"device", device.name}}, number);
  }
}

void AddPositions(Exposition& out, const MachineView& machine, MonoNs now) {
  const auto flag = [](std::int32_t bit) {
    return [bit](const DeviceView& device) { return (device.position->flags & bit) != 0 ? 1.0 : 0.0; };
  };
  out.Family("axlecast_device_position_valid", Type::kGauge, "1 while the newest position may be used, else 0.");
  EachPosition(out, machine, now, flag(position_t::FLAG_VALID));
  out.Family("axlecast_device_referenced", Type::kGauge,
             "1 while a datum is set and nothing has put it in doubt, else 0.");
  EachPosition(out, machine, now, flag(position_t::FLAG_REFERENCED));
  out.Family("axlecast_device_position_radians", Type::kGauge,
             "Angle of the shaft with its whole turns, after direction and datum, of the newest valid position.");
  EachPosition(out, machine, now, [](const DeviceView& device) { return device.Turns() * 2 * std::numbers::pi; });
  out.Family("axlecast_device_speed_radians_per_second", Type::kGauge, "Speed of the shaft, after direction.");
  EachPosition(out, machine, now,
               [](const DeviceView& device) { return device.SpeedRpm() * 2 * std::numbers::pi / 60; });
}

// Returns true if the motor's readings with `flag` are current.
bool HasMotor(const DeviceView& device, MonoNs now, std::int32_t flag) {
  return device.listed && device.motor && Answers(device, now) && (device.motor->flags & flag) != 0;
}

template <typename Value>
void EachMotor(Exposition& out, const MachineView& machine, MonoNs now, std::int32_t flag, Value value) {
  for (const DeviceView& device : machine.devices()) {
    if (!HasMotor(device, now, flag)) continue;
    const auto number = static_cast<double>(value(*device.motor));
    if (!std::isnan(number)) out.Add({{"device", device.name}}, number);
  }
}

void AddAcceleration(Exposition& out, const MachineView& machine, MonoNs now) {
  static constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
  out.Family("axlecast_motor_acceleration_meters_per_second_squared", Type::kGauge,
             "Instantaneous acceleration by axis of the unit; no vibration analysis.");
  for (const DeviceView& device : machine.devices()) {
    if (!HasMotor(device, now, motor_health_t::FLAG_ANALOG_VALID)) continue;
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
      const double value = device.motor->accel_mps2[axis];
      if (!std::isnan(value)) out.Add({{"device", device.name}, {"axis", kAxes[axis]}}, value);
    }
  }
}

}  // namespace

void AddDeviceMetrics(Exposition& out, const MachineView& machine, MonoNs now) {
  AddInfo(out, machine);
  out.Family("axlecast_device_state", Type::kGauge,
             "1 for the state the device is in, else 0; silent: its driver does not report.");
  for (const DeviceView& device : machine.devices()) {
    if (device.listed) AddStateSet(out, "device", device.name, kStates, device.State(now));
  }
  out.Family("axlecast_device_readings_total", Type::kCounter, "Good readings since the driver started.");
  Each(out, machine, [](const device_info_t& info) { return info.good; });
  AddErrors(out, machine);
  out.Family("axlecast_device_last_good_timestamp_seconds", Type::kGauge,
             "UNIX time of the last good reading; 0 before the first.");
  Each(out, machine, [](const device_info_t& info) { return static_cast<double>(info.last_good_utime) / 1e6; });
  out.Family("axlecast_device_nonvolatile_writes_total", Type::kCounter,
             "Writes to the device's memory of limited endurance by this driver process.");
  Each(out, machine, [](const device_info_t& info) { return std::int64_t{info.nv_writes}; });
  out.Family("axlecast_device_reference_lost", Type::kGauge,
             "1 from an event that put the reference in doubt until a datum or a reset of turns, else 0.");
  Each(out, machine, [](const device_info_t& info) { return std::int64_t{info.reference_lost != 0}; });
  AddPositions(out, machine, now);
}

void AddMotorMetrics(Exposition& out, const MachineView& machine, MonoNs now) {
  const auto analog = [&](std::string_view name, std::string_view help, auto value) {
    out.Family(name, Type::kGauge, help);
    EachMotor(out, machine, now, motor_health_t::FLAG_ANALOG_VALID, value);
  };
  analog("axlecast_motor_voltage_volts", "Voltage.", [](const motor_health_t& m) { return m.voltage_v; });
  analog("axlecast_motor_current_amperes", "Current.", [](const motor_health_t& m) { return m.current_a; });
  analog("axlecast_motor_power_watts", "Power.", [](const motor_health_t& m) { return m.power_w; });
  analog("axlecast_motor_temperature_celsius", "Temperature.",
         [](const motor_health_t& m) { return m.temperature_c; });
  AddAcceleration(out, machine, now);
  out.Family("axlecast_motor_trips_total", Type::kCounter, "Trips since the unit's count was cleared.");
  EachMotor(out, machine, now, motor_health_t::FLAG_STATUS_VALID,
            [](const motor_health_t& m) { return m.trip_count; });
  out.Family("axlecast_motor_tripped", Type::kGauge, "1 while the unit reports that it has tripped, else 0.");
  EachMotor(out, machine, now, motor_health_t::FLAG_STATUS_VALID,
            [](const motor_health_t& m) { return (m.flags & motor_health_t::FLAG_TRIPPED) != 0 ? 1 : 0; });
  out.Family("axlecast_motor_stop_commanded", Type::kGauge, "1 while the stop coil is set, else 0.");
  EachMotor(out, machine, now, motor_health_t::FLAG_STATUS_VALID,
            [](const motor_health_t& m) { return m.stop_coil < 0 ? std::nan("") : m.stop_coil; });
}

}  // namespace axlecast
