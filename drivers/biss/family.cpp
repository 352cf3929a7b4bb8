#include "drivers/biss/family.h"

#include "drivers/biss/settings.h"

namespace axlecast {

const Family& biss_family() {
  static const Family kFamily = {
      .name = "biss",
      .summary = "BiSS-C encoders, point to point on SPI: Rongde SAA, and others with turns or another CRC",
      .link = LinkKind::kSpi,
      .default_poll_hz = 1000,
      .max_devices_per_bus = 1,
      .operations = biss::Operations(),
      .alarms = [](const DeviceConfig&) { return biss::Alarms(); },
      .parse_bus = &biss::ParseBus,
      .parse = &biss::ParseDevice,
      .make_device = &biss::MakeDevice,
      .make_simulator = &biss::MakeBissSimulator,
      .decode = &biss::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
