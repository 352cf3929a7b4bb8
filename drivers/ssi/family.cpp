#include "drivers/ssi/family.h"

#include <memory>

#include "drivers/ssi/device.h"
#include "drivers/ssi/settings.h"

namespace axlecast {
namespace {

std::unique_ptr<Device> Make(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                             SecretSource&) {
  return std::make_unique<ssi::SsiDevice>(bus, device, output);
}

}  // namespace

const Family& ssi_family() {
  static const Family kFamily = {
      .name = "ssi",
      .summary = "Encoders on SSI through an SPI controller: SAA, TWK's 25-bit tree, and others",
      .link = LinkKind::kSpi,
      .operations = {},  // SSI carries no commands
      .parse_bus = &ssi::ParseBus,
      .parse = &ssi::ParseDevice,
      .make_device = &Make,
      .make_simulator = &ssi::MakeSsiSimulator,
      .decode = &ssi::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
