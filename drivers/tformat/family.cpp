#include "drivers/runtime/core/family.h"

#include <memory>

#include "drivers/runtime/config/config_map.h"
#include "drivers/runtime/config/machine_config.h"
#include "drivers/tformat/decode.h"
#include "drivers/tformat/device.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"
#include "drivers/tformat/simulator_script.h"

namespace axlecast {
namespace {

std::unique_ptr<DeviceSettings> Parse(ConfigMap& device) { return tformat::ParseSettings(device); }

std::unique_ptr<Device> Make(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output) {
  return std::make_unique<tformat::TFormatDevice>(bus, device, output);
}

}  // namespace

const Family& tformat_family();

const Family& tformat_family() {
  static const Family kFamily = {
      .name = "tformat",
      .summary = "Tamagawa Smart Abs and other encoders on T-format (RS-485, 2.5 Mbit/s), one per bus",
      .default_baud = tformat::kDefaultBaud,
      .max_devices_per_bus = 1,
      .operations = tformat::Operations(),
      .parse = &Parse,
      .make_device = &Make,
      .make_simulator = &tformat::MakeTFormatSimulator,
      .decode = &tformat::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
