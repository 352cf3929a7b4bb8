#include "tests/support/polled_family.h"

#include <memory>
#include <string>
#include <vector>

#include "tests/support/polled_device.h"

namespace axlecast {
namespace {

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                                   SecretSource&) {
  const auto address = static_cast<std::uint8_t>(&device - bus.devices.data());
  return std::make_unique<PolledDevice>(address, output);
}

}  // namespace

const Family& PolledFamily() {
  static const std::vector<OperationSpec> kOperations = {
      {.name = "touch", .help = "asks once", .arguments = {}, .verification = "its reply"},
      {.name = "write",
       .help = "asks once",
       .arguments = {},
       .destructive = true,
       .needs_permit = true,
       .verification = "its reply"},
  };
  static const Family kFamily = {.name = "polled",
                                 .summary = "a little encoder for tests",
                                 .default_line = {.baud = 115'200},
                                 .max_devices_per_bus = 16,
                                 .operations = kOperations,
                                 .parse = nullptr,
                                 .make_device = &MakeDevice,
                                 .make_simulator = nullptr,
                                 .decode = nullptr};
  return kFamily;
}

BusConfig PolledBus(int devices) {
  BusConfig bus;
  bus.name = "rs485-0";
  bus.family = &PolledFamily();
  bus.link.port = "/dev/ttyTEST";
  auto settings = std::make_shared<DeviceSettings>();
  settings->model = "polled";
  settings->counts_per_turn = 65'536;
  settings->max_speed_rpm = 6'000;
  settings->max_accel_rad_s2 = 80'000;
  settings->wire_time = 100 * kMicrosecond;
  for (int i = 0; i < devices; ++i) {
    DeviceConfig device;
    device.name = "axis" + std::to_string(i + 1);
    device.model = settings->model;
    device.settings = settings;
    bus.devices.push_back(device);
  }
  return bus;
}

}  // namespace axlecast
