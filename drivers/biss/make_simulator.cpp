#include "drivers/biss/make_simulator.h"

#include "core/config/config_map.h"
#include "drivers/biss/settings.h"
#include "drivers/biss/simulator.h"

namespace axlecast::biss {

std::unique_ptr<Simulator> MakeBissSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const DeviceConfig& device = bus.devices.front();
  const Format& format = Own(device).format;
  const std::size_t errors = simulate.errors().list().size();
  ConfigMap map = simulate.Named(device.name);
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  const double start_deg = map.Number("start_deg", 0, 0, 360, "deg");
  const std::int64_t most_turns = (std::int64_t{1} << static_cast<unsigned>(format.turn_bits)) - 1;
  std::int64_t start_turns = 0;
  if (format.turn_bits > 0) start_turns = map.Integer("start_turns", 0, 0, most_turns, "turns");
  const SimulatedEncoder encoder(format.bits, format.turn_bits,
                                 AngleFromDegrees(start_deg) + start_turns * kShaftTurn, seed);
  SimulatedEncoder tried = encoder;
  Script script = ReadScript(map, SimulatedEncoder::QuantityNames(), tried);
  map.Done();
  if (simulate.errors().list().size() != errors) return nullptr;
  const BissSimulator::Setup setup{.polynomial = format.crc.polynomial,
                                   .crc_bits = format.crc.bits,
                                   .crc_start = format.crc.start,
                                   .crc_inverted = format.crc.inverted};
  return std::make_unique<BissSimulator>(setup, device.name, encoder, std::move(script));
}

}  // namespace axlecast::biss
