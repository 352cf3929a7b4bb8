#include "drivers/tsubaki_sc/family.h"

#include <string>
#include <utility>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/operations.h"
#include "drivers/tsubaki_sc/register_map.h"
#include "drivers/tsubaki_sc/settings.h"
#include "drivers/tsubaki_sc/simulator/bus_simulator.h"

namespace axlecast {
namespace {

std::unique_ptr<Simulator> Simulate(const BusConfig& bus, ConfigMap& simulate) {
  std::vector<std::pair<std::string, std::uint8_t>> units;
  for (const DeviceConfig& device : bus.devices) {
    units.emplace_back(device.name, static_cast<const tsubaki_sc::ScSettings&>(*device.settings).address);
  }
  return tsubaki_sc::MakeSimulator(bus, simulate, units);
}

}  // namespace

const Family& tsubaki_sc_family() {
  static const Family kFamily = {
      .name = "tsubaki_sc",
      .summary = "Tsubaki gear-motor SC units, monitors of motors (Modbus RTU, 9600 8E1), up to 16 per bus",
      .link = LinkKind::kModbus,
      .default_line = tsubaki_sc::kUnitLine,
      .default_poll_hz = 0,
      .max_devices_per_bus = tsubaki_sc::kLastAddress,
      .has_position = false,
      .operations = tsubaki_sc::Operations(),
      .parameters = tsubaki_sc::Parameters(),
      .permits = &tsubaki_sc::Permits,
      .alarms = [](const DeviceConfig&) { return tsubaki_sc::Alarms(); },
      .parse_bus = &tsubaki_sc::ParseBusSettings,
      .parse = &tsubaki_sc::ParseSettings,
      .check_bus = &tsubaki_sc::CheckAddresses,
      .make_device = &tsubaki_sc::MakeDevice,
      .make_simulator = &Simulate,
      .decode = &tsubaki_sc::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
