#include "drivers/ssi/simulator.h"

#include <algorithm>
#include <cmath>

#include "core/config/config_map.h"
#include "drivers/ssi/settings.h"

namespace axlecast::ssi {
namespace {

using Kind = SimulatedFault::Kind;

// How SPI numbers its modes: the clock idles high; data is sampled at the second edge of a clock, not the first.
constexpr int kIdlesHigh = 2;
constexpr int kSamplesSecond = 1;
constexpr int kRightMode = 2;

}  // namespace

// ---- the encoder ----

const QuantityTable<SimulatedEncoder>& SimulatedEncoder::Table() {
  using E = SimulatedEncoder;
  static const QuantityTable<E> kTable = WithCommon(
      {
          NumberQuantity<E>(
              "cable_m", [](auto& e) -> auto& { return e.properties.cable_m; }, 0, 5'000, "m"),
          NumberQuantity<E>(
              "monoflop_us", [](auto& e) -> auto& { return e.properties.monoflop_us; }, 0.1, 100'000, "us"),
          ChoiceQuantity<E>("after_word", [](auto& e) -> auto& { return e.properties.after_word; },
                            {"zeros", "one_zero", "no_gap"}),
          NumberQuantity<E>("byte_gap_us", &E::byte_gap_us, 0, 10'000, "us"),
          ChoiceQuantity<E>("data_line", &E::data_line, {"encoder", "high", "low", "swapped"}),
          {"status", &E::SetStatus, &E::StatusText},
          WholeQuantity<E>("noise_counts", &E::noise_counts, 0, 1'000, "counts"),
      },
      [](const SimulatedFault& fault) -> Result<> {
        if (fault.kind != Kind::kDelayed && fault.kind != Kind::kLate && fault.kind != Kind::kScattered) return {};
        return Failure(": nothing is held back on a line that the host clocks; for late data slow:US");
      });
  return kTable;
}

// "none", or names of flags with blanks or commas between them.
Result<> SimulatedEncoder::SetStatus(std::string_view text) {
  const auto& flags = properties.word.flags;
  std::uint32_t found = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" ,", begin), text.size());
    const std::string_view name = text.substr(begin, end - begin);
    begin = end + 1;
    if (name.empty() || name == "none") continue;
    const auto flag =
        std::find_if(flags.begin(), flags.end(), [&](const auto& known) { return known.name == name; });
    if (flag == flags.end()) return Failure("'" + std::string(name) + "' is not one of its status_bits");
    found |= 1U << static_cast<unsigned>(flag - flags.begin());
  }
  raised = found;
  return {};
}

std::string SimulatedEncoder::StatusText() const {
  std::string text;
  for (std::size_t i = 0; i < properties.word.flags.size(); ++i) {
    if ((raised >> i & 1) != 0) text += (text.empty() ? "" : " ") + properties.word.flags[i].name;
  }
  return text.empty() ? "none" : text;
}

QuantityList SimulatedEncoder::Quantities() const {
  QuantityList list = ShownQuantities();
  const ShaftAngle angle = shaft.At(now).angle;
  const SimulatedWord& word = properties.word;
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(angle)));
  list.emplace_back("single_turn", std::to_string(CountsFromAngle(angle, word.bits)));
  if (word.turn_bits > 0) list.emplace_back("multi_turn", std::to_string(TurnsFromAngle(angle, word.turn_bits)));
  return list;
}

Levels SimulatedEncoder::WordAt(MonoNs at) {
  const SimulatedWord& word = properties.word;
  ShaftAngle angle = Measured(at);
  const auto noise = static_cast<std::int64_t>(noise_counts);
  if (noise > 0) angle += random.Around(noise) * (kShaftTurn >> std::min(word.bits, kTurnBits));
  return word.Make(static_cast<std::uint32_t>(TurnsFromAngle(angle, word.turn_bits)),
                   static_cast<std::uint32_t>(CountsFromAngle(angle, word.bits)), raised);
}

MonoNs SimulatedEncoder::monoflop() const { return std::llround(properties.monoflop_us * 1e3); }

MonoNs SimulatedEncoder::delay() const {
  return std::llround(properties.electronics_ns + 2 * properties.cable_ns_per_m * properties.cable_m +
                      slow_us() * 1e3);
}

MonoNs SimulatedEncoder::byte_gap() const { return std::llround(byte_gap_us * 1e3); }

// ---- its line ----

SsiSimulator::SsiSimulator(std::string device, SimulatedEncoder encoder, Script script, ClockRange range)
    : UnitSimulator({{std::move(device), std::move(encoder), std::move(script)}}), range_(range) {}

void SsiSimulator::CatchUp(MonoNs now) {
  UnitSimulator::CatchUp(now);
  output_.SetMonoflop(encoder().monoflop());
  output_.SetAfterWord(encoder().properties.after_word);
}

// ---- a transfer ----

void SsiSimulator::OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) {
  CatchUp(now);
  ++counters_.transfers;
  std::fill(rx.begin(), rx.end(), std::uint8_t{0xFF});
  if (transfer.settings.clock_hz <= 0) return;
  const bool answers = Answers();
  if (!answers) ++counters_.unanswered;
  Complain(transfer, now);
  if (answers) ClockOut(transfer, now, rx);
  const auto clock = static_cast<double>(transfer.settings.clock_hz);
  Disturb(transfer, range_.max_hz > 0 && clock >= range_.max_hz, rx);
}

bool SsiSimulator::Answers() {
  const SimulatedFault& fault = encoder().fault;
  const bool lost = fault.kind == Kind::kIntermittent && encoder().random.Share() < fault.amount;
  return encoder().powered && fault.kind != Kind::kOff && !lost;
}

void SsiSimulator::Complain(const SpiTransfer& transfer, MonoNs now) {
  const auto clock = static_cast<double>(transfer.settings.clock_hz);
  const double cycle_ns = 1e9 / clock;
  const auto length = static_cast<std::size_t>(encoder().properties.word.length);
  const auto count = [](bool is, std::int64_t& counter) { counter += is ? 1 : 0; };
  count(transfer.settings.mode != kRightMode, counters_.wrong_mode);
  // TWK SSI 10: t_T < t_M; SAA manual 5.5: 100 kHz < f < 250 kHz.
  count(cycle_ns >= static_cast<double>(encoder().monoflop()) || clock <= range_.min_hz, counters_.slow_clocks);
  count(range_.max_hz > 0 && clock >= range_.max_hz, counters_.fast_clocks);
  count(cycle_ns / 2 <= static_cast<double>(encoder().delay()), counters_.late_data);
  count(output_.IsSet(now), counters_.short_pauses);
  // TWK SSI 2: "a clock sequence of n + 1 cycles is needed".
  count(transfer.tx.size() * 8 < length + 1, counters_.few_clocks);
}

void SsiSimulator::ClockOut(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) {
  const double cycle_ns = 1e9 / static_cast<double>(transfer.settings.clock_hz);
  const bool idles_high = (transfer.settings.mode & kIdlesHigh) != 0;
  const bool samples_second = (transfer.settings.mode & kSamplesSecond) != 0;
  const SimulatedFault fault = encoder().fault;
  const bool ends_early = fault.kind == Kind::kShort && encoder().random.Share() < fault.amount;
  const std::size_t clocks = rx.size() * 8;
  const std::size_t end = ends_early ? encoder().random.Next() % clocks : clocks;
  const std::int64_t latched_before = counters_.latches;

  for (std::size_t i = 0; i < clocks; ++i) {
    const MonoNs gaps = static_cast<MonoNs>(i / 8) * encoder().byte_gap();
    const MonoNs first = now + gaps + std::llround(static_cast<double>(i) * cycle_ns);
    const MonoNs second = first + std::llround(cycle_ns / 2);
    const bool heard = fault.kind != Kind::kRequestFlip || encoder().random.Share() >= fault.amount;
    if (i == end) output_.Reset(first);
    if (heard) Edge(idles_high, first);
    const bool at_first = !samples_second && Sampled(first);
    if (heard) Edge(!idles_high, second);
    const bool level = samples_second ? Sampled(second) : at_first;
    const auto bit = static_cast<std::uint8_t>(0x80U >> i % 8);
    rx[i / 8] = static_cast<std::uint8_t>(level ? rx[i / 8] | bit : rx[i / 8] & ~bit);
  }
  if (counters_.latches > latched_before + 1) ++counters_.monoflop_ends;
}

void SsiSimulator::Edge(bool falling, MonoNs at) {
  if (!falling) return output_.Rise(at);
  output_.Fall(at, [this](MonoNs latched) {
    ++counters_.latches;
    return encoder().WordAt(latched);
  });
}

// Both ways of the cable lie between the line at the encoder and what the host samples.
bool SsiSimulator::Sampled(MonoNs at) { return output_.LevelBefore(at - encoder().delay()); }

void SsiSimulator::Disturb(const SpiTransfer& transfer, bool fast, std::span<std::uint8_t> rx) {
  using DataLine = SimulatedEncoder::DataLine;
  const SimulatedFault& fault = encoder().fault;
  if (fast || fault.kind == Kind::kGarbage) {
    for (std::uint8_t& byte : rx) byte = static_cast<std::uint8_t>(encoder().random.Next());
  } else if (fault.kind == Kind::kEcho) {
    std::copy(transfer.tx.begin(), transfer.tx.end(), rx.begin());
  } else if (fault.kind == Kind::kBitFlip) {
    FlipBits(rx, 8, fault.amount, encoder().random);
  }
  if (encoder().data_line == DataLine::kHigh) std::fill(rx.begin(), rx.end(), std::uint8_t{0xFF});
  if (encoder().data_line == DataLine::kLow) std::fill(rx.begin(), rx.end(), std::uint8_t{0});
  if (encoder().data_line == DataLine::kSwapped) {
    for (std::uint8_t& byte : rx) byte = static_cast<std::uint8_t>(~byte);
  }
}

SsiSimulator::CounterList SsiSimulator::CountersOf(const Unit&) const {
  return {{"transfers", counters_.transfers},     {"latches", counters_.latches},
          {"unanswered", counters_.unanswered},   {"wrong_mode", counters_.wrong_mode},
          {"slow_clocks", counters_.slow_clocks}, {"fast_clocks", counters_.fast_clocks},
          {"late_data", counters_.late_data},     {"short_pauses", counters_.short_pauses},
          {"few_clocks", counters_.few_clocks},   {"monoflop_ends", counters_.monoflop_ends}};
}

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

// If the file does not define what follows the word, the encoder behaves as its maker's document states.
SimulatedOutput::AfterWord DescribedAfter(const SsiSettings& settings) {
  using After = SimulatedOutput::AfterWord;
  const Format& format = settings.format;
  const bool defined = format.words > 1 || format.trailing_checked;
  if (!defined) return MakerOf(settings.model) == Maker::kSaa ? After::kNoGap : After::kOneZero;
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
  return {properties, ReadShaftStart(map, settings.format.turn_bits)};
}

}  // namespace

std::unique_ptr<Simulator> MakeSsiSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const DeviceConfig& device = bus.devices.front();
  const std::size_t errors = simulate.errors().list().size();
  ConfigMap map = simulate.Named(device.name);
  const SimulatedEncoder encoder = DescribedEncoder(bus, Own(device), map);
  Script script = ReadScriptOf(map, encoder);
  if (simulate.errors().list().size() != errors) return nullptr;
  const ClockedLine& line = OwnBus(bus).line;
  return std::make_unique<SsiSimulator>(device.name, encoder, std::move(script),
                                        SsiSimulator::ClockRange{line.least_hz, line.most_hz});
}

namespace {

Levels Binary(std::uint32_t value, int bits) {
  Levels levels;
  for (int bit = bits - 1; bit >= 0; --bit) levels.push_back((value >> bit & 1) != 0);
  return levels;
}

// Gray code: each bit is the exclusive or of the binary bit and the one before it.
Levels Gray(const Levels& binary) {
  Levels gray = binary;
  for (std::size_t i = 1; i < gray.size(); ++i) gray[i] = binary[i] != binary[i - 1];
  return gray;
}

Levels Joined(Levels front, const Levels& back) {
  front.insert(front.end(), back.begin(), back.end());
  return front;
}

}  // namespace

Levels SimulatedWord::Make(std::uint32_t turns, std::uint32_t counts, std::uint32_t raised) const {
  const Levels many = Binary(turns, turn_bits);
  const Levels one = Binary(counts, bits);
  Levels position = Joined(many, one);
  if (gray) position = one_gray_code ? Gray(position) : Joined(Gray(many), Gray(one));

  Levels word(static_cast<std::size_t>(length), false);
  std::copy(position.begin(), position.end(), word.begin() + position_at);
  for (std::size_t i = 0; i < flags.size(); ++i) {
    const bool is_raised = (raised >> i & 1) != 0;
    word[static_cast<std::size_t>(flags[i].place)] = is_raised == flags[i].active_level;
  }
  if (parity_at >= 0) {
    const bool odd_so_far = std::count(word.begin(), word.end(), true) % 2 == 1;
    word[static_cast<std::size_t>(parity_at)] = odd_so_far != parity_odd;
  }
  return word;
}

// "The data signal switches to Log 1 on the expiration of the monoflop time."
void SimulatedOutput::RunDown(MonoNs now) {
  if (!set_ || now < expires_) return;
  set_ = false;
  changes_.push_back({expires_, true});
}

void SimulatedOutput::Fall(MonoNs at, const std::function<Levels(MonoNs at)>& latch) {
  RunDown(at);
  if (!set_) {
    set_ = true;
    word_ = latch(at);
    clocks_ = 0;
  }
  expires_ = at + monoflop_;
}

void SimulatedOutput::Rise(MonoNs at) {
  RunDown(at);
  if (set_) changes_.push_back({at, LevelOf(clocks_++)});
}

void SimulatedOutput::Reset(MonoNs at) {
  set_ = false;
  changes_.push_back({at, true});
}

// The level of the line after one positive edge more than `clocks`.
bool SimulatedOutput::LevelOf(std::size_t clocks) const {
  if (clocks < word_.size()) return word_[clocks];
  switch (after_) {
    case AfterWord::kOneZero: {
      const std::size_t place = clocks % (word_.size() + 1);
      return place < word_.size() && word_[place];
    }
    case AfterWord::kNoGap:
      return word_[clocks % word_.size()];
    default:
      return false;
  }
}

bool SimulatedOutput::LevelBefore(MonoNs at) {
  RunDown(at);
  while (!changes_.empty() && changes_.front().at < at) {
    level_ = changes_.front().level;
    changes_.pop_front();
  }
  return level_;
}

}  // namespace axlecast::ssi
