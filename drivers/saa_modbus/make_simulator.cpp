#include "drivers/saa_modbus/make_simulator.h"

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/saa_modbus/codec.h"
#include "drivers/saa_modbus/settings.h"
#include "drivers/saa_modbus/simulator.h"

namespace axlecast::saa_modbus {
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

}  // namespace

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

}  // namespace axlecast::saa_modbus
