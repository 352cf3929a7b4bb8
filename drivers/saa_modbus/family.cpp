#include <memory>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "drivers/saa_modbus/codec.h"
#include "drivers/saa_modbus/decode.h"
#include "drivers/saa_modbus/device.h"
#include "drivers/saa_modbus/operations.h"
#include "drivers/saa_modbus/settings.h"
#include "drivers/saa_modbus/simulator/modbus_line.h"

namespace axlecast {
namespace saa_modbus {
namespace {

// The encoder that the device's own keys describe, as the file expects to find it.
SimulatedEncoder Described(const BusConfig& bus, const DeviceConfig& device, ConfigMap& map) {
  const auto& settings = static_cast<const SaaModbusSettings&>(*device.settings);
  const auto bits = static_cast<int>(map.Integer("bits", settings.bits, kMinBits, kMaxBits, "bits"));
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  SimulatedEncoder encoder(bits, seed);
  encoder.address = settings.address;
  encoder.baud = bus.link.line.baud;
  encoder.shaft = Shaft(AngleFromDegrees(map.Number("start_deg", 0, 0, 360, "deg")));
  return encoder;
}

std::unique_ptr<Simulator> MakeSaaModbusSimulator(const BusConfig& bus, ConfigMap& simulate) {
  const std::size_t errors = simulate.errors().list().size();
  SaaModbusSimulator::Line line{.format = bus.link.line, .echo = bus.link.echo};
  line.paced = simulate.Choice("pace", {"wire", "unpaced"}, 0) == 0;
  auto simulator = std::make_unique<SaaModbusSimulator>(line);
  for (const DeviceConfig& device : bus.devices) {
    ConfigMap map = simulate.Named(device.name);
    const SimulatedEncoder encoder = Described(bus, device, map);
    SimulatedEncoder tried = encoder;
    Script script = ReadScript(map, QuantityNames(), tried);
    map.Done();
    simulator->Add(device.name, encoder, std::move(script));
  }
  if (simulate.errors().list().size() != errors) return nullptr;
  return simulator;
}

}  // namespace
}  // namespace saa_modbus

namespace {

std::unique_ptr<Device> Make(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                             SecretSource&) {
  return std::make_unique<saa_modbus::SaaModbusDevice>(bus, device, output);
}

}  // namespace

const Family& saa_modbus_family();

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
      .parse_bus = &saa_modbus::ParseBus,
      .parse = &saa_modbus::ParseSettings,
      .check_bus = &saa_modbus::CheckBus,
      .make_device = &Make,
      .make_simulator = &saa_modbus::MakeSaaModbusSimulator,
      .decode = &saa_modbus::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
