#include "drivers/tformat/simulator_script.h"

#include <cmath>

#include "drivers/runtime/config/config_map.h"
#include "drivers/runtime/config/machine_config.h"
#include "drivers/tformat/settings.h"
#include "drivers/tformat/simulator.h"

namespace axlecast::tformat {
namespace {

void Apply(SimulatedAxis& axis, const SimulatorScript::Assignments& quantities) {
  // Each was tried when the file was read; what was refused there never gets here.
  for (const auto& [name, value] : quantities) {
    [[maybe_unused]] const std::string problem = SetQuantity(axis, name, value);
  }
}

}  // namespace

SimulatorScript::SimulatorScript(Assignments initial, std::vector<Step> steps, MonoNs period)
    : initial_(std::move(initial)), steps_(std::move(steps)), period_(period) {}

void SimulatorScript::Start(SimulatedAxis& axis, MonoNs now) {
  axis.encoder.Advance(now);
  Apply(axis, initial_);
  round_ = now;
  next_ = 0;
}

MonoNs SimulatorScript::NextDue() const { return next_ < steps_.size() ? round_ + steps_[next_].at : kNever; }

void SimulatorScript::Run(SimulatedAxis& axis, MonoNs now) {
  while (NextDue() <= now) {
    axis.encoder.Advance(NextDue());
    Apply(axis, steps_[next_].quantities);
    if (++next_ == steps_.size() && period_ != kNever) {
      next_ = 0;
      round_ += period_;
    }
  }
}

namespace {

// The quantities of one mapping, tried on `axis` as they are read.
SimulatorScript::Assignments ReadQuantities(ConfigMap& map, SimulatedAxis& axis) {
  SimulatorScript::Assignments quantities;
  for (const std::string_view name : QuantityNames()) {
    if (!map.Has(name)) continue;
    const std::string value = map.String(name, "");
    const std::string problem = SetQuantity(axis, name, value);
    if (problem.empty()) {
      quantities.emplace_back(name, value);
    } else {
      map.Error(name, problem);
    }
  }
  if (map.Has("motion") && map.Has("speed_rpm")) map.Error("speed_rpm", "excludes motion: keep one of the two");
  return quantities;
}

struct ScriptFile {
  std::vector<SimulatorScript::Step> steps;
  MonoNs period = kNever;
};

ScriptFile ReadScript(ConfigMap& map, SimulatedAxis axis) {
  constexpr double kMostSeconds = 1e6;
  ScriptFile script;
  for (ConfigMap& entry : map.List("script")) {
    if (!entry.Has("at_s")) entry.Error("at_s", "is missing: the time of this step after the start, in seconds");
    SimulatorScript::Step step;
    step.at = std::llround(entry.Number("at_s", 0, 0, kMostSeconds, "s") * 1e9);
    if (!script.steps.empty() && step.at < script.steps.back().at) {
      entry.Error("at_s", "is earlier than the step before it: put the steps in the order of their times");
    }
    axis.encoder.Advance(step.at);
    step.quantities = ReadQuantities(entry, axis);
    entry.Done();
    script.steps.push_back(std::move(step));
  }
  const double period_s = map.Number("script_period_s", 0, 0, kMostSeconds, "s (0: once)");
  if (period_s > 0) script.period = std::llround(period_s * 1e9);
  if (!script.steps.empty() && script.period <= script.steps.back().at) {
    map.Error("script_period_s", "must be later than the script's last step");
  }
  return script;
}

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
  ConfigMap map = simulate.Map(device.name);
  const SimulatedAxis axis = DescribedAxis(device, map);
  SimulatedAxis tried = axis;
  SimulatorScript::Assignments initial = ReadQuantities(map, tried);
  ScriptFile script = ReadScript(map, tried);
  map.Done();
  if (simulate.errors().list().size() != errors) return nullptr;

  TFormatSimulator::Line line;
  line.echo = bus.link.echo;
  line.seed = axis.encoder.settings().seed;
  if (bus.link.baud > 0) line.byte_time = WireTime(1, bus.link.baud);
  return std::make_unique<TFormatSimulator>(
      device.name, axis, SimulatorScript(std::move(initial), std::move(script.steps), script.period), line);
}

}  // namespace axlecast::tformat
