#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/config/machine_config.h"
#include "core/messages/message.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// A machine of one bus `rs485-0` with one device `axis1`, and its messages; for tests.
inline MachineConfig OneAxis(const Family* family = nullptr) {
  MachineConfig machine;
  machine.machine = "press3";
  machine.file = "machine.yaml";
  BusConfig bus;
  bus.name = "rs485-0";
  bus.family = family;
  DeviceConfig device;
  device.name = "axis1";
  bus.devices.push_back(device);
  machine.buses.push_back(bus);
  return machine;
}

// Returns a machine of `number` buses `line0`, `line1`, ... with one device each: `axis0`, `axis1`, ...
inline MachineConfig Axes(std::size_t number) {
  MachineConfig machine;
  machine.machine = "hall3";
  machine.file = "machine.yaml";
  for (std::size_t i = 0; i < number; ++i) {
    BusConfig& bus = machine.buses.emplace_back();
    bus.name = "line" + std::to_string(i);
    bus.devices.emplace_back().name = "axis" + std::to_string(i);
  }
  return machine;
}

// 12.5 turns of 5 mm, turning at 60 rpm.
inline position_t PositionMessage(std::int64_t seq) {
  position_t position{};
  position.boot_id = 7;
  position.seq = seq;
  position.counts_per_turn = 131072;
  position.counts = 12 * 131072 + 65536;
  position.value = 62.5;
  position.unit = position_t::UNIT_MM;
  position.speed_rad_s = 6.283185307179586;
  position.flags = std::int32_t{position_t::FLAG_VALID} | position_t::FLAG_SPEED_VALID;
  return position;
}

inline device_info_t DeviceMessage(std::int8_t state) {
  device_info_t info{};
  info.device = "axis1";
  info.bus = "rs485-0";
  info.state = state;
  info.counts_per_turn = 131072;
  info.per_turn = 5;
  info.ratio_num = 1;
  info.ratio_den = 1;
  info.unit = position_t::UNIT_MM;
  return info;
}

inline bus_health_t BusMessage(std::int8_t state) {
  bus_health_t health{};
  health.bus = "rs485-0";
  health.state = state;
  health.rate_hz = 1000;
  health.wire_limit_hz = 19608;
  health.utilisation = 0.051F;
  health.good = 5000;
  return health;
}

}  // namespace axlecast
