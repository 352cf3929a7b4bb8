#include "drivers/ssi/make_simulator.h"

#include "core/config/config_map.h"
#include "drivers/ssi/settings.h"
#include "drivers/ssi/simulator.h"

namespace axlecast::ssi {
namespace {

SimulatedWord DescribedWord(const SsiSettings& settings) {
  const Format& format = settings.format;
  SimulatedWord word;
  word.length = format.word_bits;
  word.position_at = format.first;
  word.turn_bits = format.turn_bits;
  word.bits = format.bits;
  word.gray = format.gray;
  word.one_gray_code = format.joint;
  for (const StatusBit& bit : settings.status_bits) word.flags.push_back({bit.name, bit.place, bit.active_high});
  word.parity_at = settings.parity_place;
  word.parity_odd = format.parity == ParityRule::kOdd;
  return word;
}

// Where the file leaves open what follows the word, the encoder does what its maker's document says.
SimulatedOutput::AfterWord DescribedAfter(const SsiSettings& settings) {
  using After = SimulatedOutput::AfterWord;
  const Format& format = settings.format;
  const bool told = format.words > 1 || format.trailing_checked;
  if (!told) return MakerOf(settings.model) == Maker::kSaa ? After::kNoGap : After::kOneZero;
  switch (format.after) {
    case AfterWord::kZeroThenWord:
      return After::kOneZero;
    case AfterWord::kWord:
      return After::kNoGap;
    default:
      return After::kZeros;
  }
}

SimulatedEncoder DescribedEncoder(const BusConfig& bus, const SsiSettings& settings, ConfigMap& map) {
  const SsiBus& own = OwnBus(bus);
  SimulatedEncoder::Properties properties;
  properties.word = DescribedWord(settings);
  // The longest that it may be: the hardest for the pauses.
  properties.monoflop_us = static_cast<double>(own.monoflop_max) / 1e3;
  properties.after_word = DescribedAfter(settings);
  properties.cable_m = own.line.cable_m;
  properties.electronics_ns = own.line.encoder_delay_ns + own.line.receiver_delay_ns;
  properties.cable_ns_per_m = own.line.cable_ns_per_m;
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  const double start_deg = map.Number("start_deg", 0, 0, 360, "deg");
  const std::int64_t most_turns = (std::int64_t{1} << settings.format.turn_bits) - 1;
  const std::int64_t start_turns = map.Integer("start_turns", 0, 0, most_turns, "turns");
  return {properties, start_turns * kShaftTurn + AngleFromDegrees(start_deg), seed};
}

}  // namespace

std::unique_ptr<Simulator> MakeSsiSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const DeviceConfig& device = bus.devices.front();
  const std::size_t errors = simulate.errors().list().size();
  ConfigMap map = simulate.Named(device.name);
  const SimulatedEncoder encoder = DescribedEncoder(bus, Own(device), map);
  SimulatedEncoder tried = encoder;
  Script script = ReadScript(map, SimulatedEncoder::QuantityNames(), tried);
  map.Done();
  if (simulate.errors().list().size() != errors) return nullptr;
  const ClockedLine& line = OwnBus(bus).line;
  return std::make_unique<SsiSimulator>(device.name, encoder, std::move(script),
                                        SsiSimulator::ClockRange{line.least_hz, line.most_hz});
}

}  // namespace axlecast::ssi
