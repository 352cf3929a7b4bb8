#include "drivers/tformat/family.h"

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast {
namespace {

std::unique_ptr<DeviceSettings> Parse(ConfigMap& device, const BusConfig& bus) {
  return tformat::ParseSettings(device, bus.link.line);
}

}  // namespace

const Family& tformat_family() {
  static const Family kFamily = {
      .name = "tformat",
      .summary = "Tamagawa Smart Abs and other encoders on T-format (RS-485, 2.5 Mbit/s), one per bus",
      .default_line = {.baud = 2'500'000},
      .max_devices_per_bus = 1,
      .operations = tformat::Operations(),
      .permits = &tformat::Permits,
      .alarms = [](const DeviceConfig&) { return tformat::Alarms(); },
      .parse = &Parse,
      .check_bus = &tformat::CheckLine,
      .make_device = [](const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                        SecretSource&) { return tformat::MakeDevice(bus, device, output); },
      .make_simulator = &tformat::MakeTFormatSimulator,
      .decode = &tformat::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
