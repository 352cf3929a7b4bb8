#include "drivers/tformat/make_simulator.h"

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/tformat/settings.h"
#include "drivers/tformat/simulator.h"

namespace axlecast::tformat {
namespace {

// The encoder that the device's own keys describe.
SimulatedAxis DescribedAxis(const DeviceConfig& device, ConfigMap& map) {
  const auto* described = dynamic_cast<const TFormatSettings*>(device.settings.get());
  const TFormatSettings usual;
  const TFormatSettings& known = described != nullptr ? *described : usual;
  EncoderModel::Settings settings;
  settings.single_turn_bits = static_cast<int>(map.Integer("bits", known.format.single_turn_bits, 6, 24, "bits"));
  settings.multi_turn_bits =
      static_cast<int>(map.Integer("turn_bits", known.format.multi_turn_bits, 0, 24, "bits"));
  settings.seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  if (described != nullptr) settings.encoder_id = known.encoder_id;
  const double start_deg = map.Number("start_deg", 0, 0, 360, "deg");
  const std::int64_t most_turns = (std::int64_t{1} << settings.multi_turn_bits) - 1;
  const std::int64_t start_turns = map.Integer("start_turns", 0, 0, most_turns, "turns");

  SimulatedAxis axis(EncoderModel(settings, start_turns * kShaftTurn + AngleFromDegrees(start_deg)));
  if (!known.battery) axis.encoder.SetBattery(0, 0);
  if (known.identity) {
    std::uint8_t cell = known.identity->address;
    for (const std::uint8_t byte : known.identity->bytes) axis.encoder.eeprom().Preset(cell++, byte);
  }
  return axis;
}

}  // namespace

std::unique_ptr<Simulator> MakeTFormatSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const DeviceConfig& device = bus.devices.front();
  const std::size_t errors = simulate.errors().list().size();
  ConfigMap map = simulate.Named(device.name);
  const SimulatedAxis axis = DescribedAxis(device, map);
  SimulatedAxis tried = axis;
  Script script = ReadScript(map, QuantityNames(), tried);
  map.Done();
  if (simulate.errors().list().size() != errors) return nullptr;

  TFormatSimulator::Line line;
  line.echo = bus.link.echo;
  line.seed = axis.encoder.settings().seed;
  line.baud = bus.link.line.baud;
  if (line.baud > 0) line.byte_time = bus.link.line.WireTime(1);
  return std::make_unique<TFormatSimulator>(device.name, axis, std::move(script), line);
}

}  // namespace axlecast::tformat
