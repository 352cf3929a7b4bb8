#include "core/device/family.h"

#include <memory>

#include "drivers/saa_can/cia406/cia406.h"
#include "drivers/saa_can/decode.h"
#include "drivers/saa_can/device.h"
#include "drivers/saa_can/make_simulator.h"
#include "drivers/saa_can/operations.h"
#include "drivers/saa_can/settings.h"

namespace axlecast {
namespace {

std::unique_ptr<Device> Make(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                             SecretSource&) {
  if (saa_can::cia406::IsOwn(device)) return saa_can::cia406::MakeDevice(bus, device, output);
  return std::make_unique<saa_can::SaaCanDevice>(bus, device, output);
}

}  // namespace

const Family& saa_can_family();

const Family& saa_can_family() {
  static const Family kFamily = {
      .name = "saa_can",
      .summary = "Rongde SAA encoders on CAN, by themselves or asked for; and CANopen encoders (model: cia406)",
      .link = LinkKind::kCan,
      .default_bitrate = saa_can::kFactoryBitrate,
      .default_poll_hz = 0,  // as they come
      .max_devices_per_bus = saa_can::kMaxDevices,
      .operations = saa_can::Operations(),
      .permits = &saa_can::Permits,
      .parse_bus = &saa_can::ParseBus,
      .parse = &saa_can::ParseDevice,
      .check_bus = &saa_can::CheckBus,
      .make_device = &Make,
      .make_simulator = &saa_can::MakeSimulator,
      .decode = &saa_can::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
