#include "drivers/ssi/family.h"

#include "drivers/ssi/settings.h"

namespace axlecast {

const Family& ssi_family() {
  static const Family kFamily = {
      .name = "ssi",
      .summary = "Encoders on SSI through an SPI controller: SAA, TWK's 25-bit tree, and others",
      .link = LinkKind::kSpi,
      .operations = {},  // SSI carries no commands
      .alarms = &ssi::Alarms,
      .parse_bus = &ssi::ParseBus,
      .parse = &ssi::ParseDevice,
      .make_device = [](const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                        SecretSource&) { return ssi::MakeDevice(bus, device, output); },
      .make_simulator = &ssi::MakeSsiSimulator,
      .decode = &ssi::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
