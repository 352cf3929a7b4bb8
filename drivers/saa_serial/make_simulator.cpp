#include "drivers/saa_serial/make_simulator.h"

#include "core/config/config_map.h"
#include "drivers/saa_serial/settings.h"
#include "drivers/saa_serial/simulator.h"

namespace axlecast::saa_serial {
namespace {

SaaSimulator::Unit MakeUnit(const DeviceConfig& device, ConfigMap map) {
  const SaaSettings& settings = Own(device);
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  const double start_deg = map.Number("start_deg", 0, 0, 360, "deg");
  const bool zero_clearing = map.Bool("zero_clearing", true);
  SaaSimulator::Unit unit{.name = device.name,
                          .encoder = SimulatedEncoder(settings.format.bits, AngleFromDegrees(start_deg), seed),
                          .script = {},
                          .control = settings.format.address,
                          .zero = -1};
  if (settings.zero_command && zero_clearing) unit.zero = *settings.zero_command;
  SimulatedEncoder tried = unit.encoder;
  unit.script = ReadScript(map, SimulatedEncoder::QuantityNames(), tried);
  map.Done();
  return unit;
}

}  // namespace

std::unique_ptr<Simulator> MakeSaaSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const std::size_t errors = simulate.errors().list().size();
  const SaaBus& own = OwnBus(bus);
  SaaSimulator::Setup setup;
  setup.mode = static_cast<SaaSimulator::Mode>(own.mode);
  if (own.clk) setup.clk = own.clk->index;
  if (own.clr) setup.clr = own.clr->index;
  setup.refresh = own.refresh;
  setup.baud = bus.link.line.baud;
  setup.character = bus.link.line.WireTime(1);
  setup.echo = bus.link.echo;
  std::vector<SaaSimulator::Unit> units;
  for (const DeviceConfig& device : bus.devices) units.push_back(MakeUnit(device, simulate.Named(device.name)));
  if (simulate.errors().list().size() != errors) return nullptr;
  return std::make_unique<SaaSimulator>(setup, std::move(units));
}

}  // namespace axlecast::saa_serial
