#include "drivers/saa_modbus/family.h"

#include <vector>

#include "drivers/saa_modbus/operations.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast {

const Family& saa_modbus_family() {
  static const Family kFamily = {
      .name = "saa_modbus",
      .summary = "SAA single-turn encoders on Modbus RTU (RS-485, 2,400 to 57,600 Bd), up to 32 per bus",
      .link = LinkKind::kModbus,
      .default_line = {.baud = 19'200},
      .default_poll_hz = 0,
      .max_devices_per_bus = saa_modbus::kMaxDevices,
      .operations = saa_modbus::Operations(),
      .permits = &saa_modbus::Permits,
      .alarms = [](const DeviceConfig&) { return std::vector{saa_modbus::kConfigurationDiffers}; },
      .parse_bus = &saa_modbus::ParseBus,
      .parse = &saa_modbus::ParseSettings,
      .check_bus = &saa_modbus::CheckBus,
      .make_device = &saa_modbus::MakeDevice,
      .make_simulator = &saa_modbus::MakeSaaModbusSimulator,
      .decode = &saa_modbus::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
