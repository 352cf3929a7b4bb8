#include "drivers/tsubaki_sc/simulator/make_simulator.h"

#include <cmath>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/tsubaki_sc/simulator/bus_simulator.h"

namespace axlecast::tsubaki_sc {
namespace {

using simulator::BusSimulator;
using simulator::LineRules;
using simulator::SimulatedUnit;
using simulator::Station;

// Of the bus as a whole, beside its units.
constexpr std::string_view kTiming = "timing";

MonoNs Milliseconds(ConfigMap& map, std::string_view key, MonoNs usual, double min, double max) {
  const double number = map.Number(key, static_cast<double>(usual) / kMillisecond, min, max, "ms");
  return std::llround(number * kMillisecond);
}

LineRules ReadRules(ConfigMap map, bool echo) {
  LineRules rules;
  rules.reading = static_cast<LineRules::Reading>(map.Choice("reading", {"A", "L", "W", "none"}, 0));
  rules.paced = map.Choice("pace", {"wire", "unpaced"}, 0) == 0;
  rules.reply_delay = Milliseconds(map, "reply_delay_ms", rules.reply_delay, 5, 1000);
  rules.tolerance = Milliseconds(map, "tolerance_ms", rules.tolerance, 0, 50);
  rules.echo = echo;
  map.Done();
  return rules;
}

Station ReadStation(ConfigMap map, const std::string& name, std::uint8_t address) {
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", address, 0, INT64_MAX, ""));
  const SimulatedUnit simulated(seed);
  SimulatedUnit trial = simulated;
  trial.Advance(0);
  Station station{.name = name,
                  .address = address,
                  .simulated = simulated,
                  .script = ReadScript(map, simulator::QuantityNames(), trial),
                  .random = SeededRandom(seed),
                  .counters = {}};
  map.Done();
  return station;
}

}  // namespace

std::unique_ptr<Simulator> MakeSimulator(const BusConfig& bus, ConfigMap& simulate,
                                         std::span<const std::pair<std::string, std::uint8_t>> units) {
  const std::size_t errors = simulate.errors().list().size();
  const LineRules rules = ReadRules(simulate.Map(kTiming), bus.link.echo);
  std::vector<Station> stations;
  for (const auto& [name, address] : units) {
    if (name == kTiming) {
      simulate.Error(name, "is the line's timing here: a unit with this name cannot be simulated");
      continue;
    }
    stations.push_back(ReadStation(simulate.Named(name), name, address));
  }
  if (stations.empty() || simulate.errors().list().size() != errors) return nullptr;
  return std::make_unique<BusSimulator>(std::move(stations), rules);
}

}  // namespace axlecast::tsubaki_sc
