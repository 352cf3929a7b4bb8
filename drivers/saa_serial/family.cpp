#include "drivers/saa_serial/family.h"

#include "drivers/saa_serial/operations.h"
#include "drivers/saa_serial/settings.h"

namespace axlecast {

const Family& saa_serial_family() {
  static const Family kFamily = {
      .name = "saa_serial",
      .summary =
          "Rongde SAA encoders over RS-485, RS-422 or RS-232: streaming, on CLK, or up to 16 on a polled bus",
      .link = LinkKind::kSerial,
      .default_line = {},    // the maker sets the rate to order
      .default_poll_hz = 0,  // nor is there a usual rate of readings
      .max_devices_per_bus = 16,
      .operations = saa_serial::Operations(),
      .permits = &saa_serial::Permits,
      .parse_bus = &saa_serial::ParseBus,
      .parse = &saa_serial::ParseDevice,
      .check_bus = &saa_serial::CheckBus,
      .make_device = &saa_serial::MakeDevice,
      .make_simulator = &saa_serial::MakeSaaSimulator,
      .decode = &saa_serial::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
