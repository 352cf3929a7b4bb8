#include "drivers/ssi/settings.h"

#include <algorithm>
#include <cmath>

#include "core/config/config_map.h"
#include "core/device/operation.h"
#include "drivers/saa/data_sheet.h"

namespace axlecast::ssi {

namespace {

// A word has no checksum: at one wrong sample in a thousand the same bit of a word is wrong three times in a row once in
// 10^9 words, five times once in 10^15.
constexpr int kReadingsToBelieve = 5;

// SAA manual 5.5 (2): "100kHz < f < 250kHz"; "Tcs > 4 us", which is taken as the clock's cycle and means the same.
constexpr double kSaaLeastHz = 100e3;
constexpr double kSaaMostHz = 250e3;
// The same: "Tm > 500 us".
constexpr double kSaaPauseUs = 500;
// TWK SSI 10: "15 us <= t_M <= 25 us" in the standard version.
constexpr double kTwkMonoflopMinUs = 15;
constexpr double kTwkMonoflopMaxUs = 25;
// TWK's document gives no limit for the encoder's clock, nor a speed: ours.
constexpr double kUsualMostHz = 1e6;
constexpr double kUsualMaxRpm = 6'000;
constexpr double kMaxUs = 100'000;
constexpr double kMaxHz = 50e6;

MonoNs FromUs(double us) { return std::llround(us * 1e3); }

// The model of the bus's one device, whose own keys are read later: what its line is like depends on it.
Maker PeekMaker(const ConfigMap& map) {
  const YAML::Node bus = map.node();
  if (!bus.IsMap()) return Maker::kSaa;
  const YAML::Node devices = bus["devices"];
  if (!devices.IsDefined() || !devices.IsMap() || devices.size() == 0) return Maker::kSaa;
  const YAML::Node device = devices.begin()->second;
  if (!device.IsMap() || !device["model"].IsDefined() || !device["model"].IsScalar()) return Maker::kSaa;
  return MakerOf(device["model"].Scalar());
}

void ParseMonoflop(ConfigMap& map, Maker maker, SsiBus& own) {
  if (maker == Maker::kCustom && !map.Has("monoflop_us")) {
    map.Error("monoflop_us", "is missing: the encoder's monoflop time from its data sheet, {min: 15, max: 25}");
  }
  const double min_usual = maker == Maker::kTwk ? kTwkMonoflopMinUs : 0;
  const double max_usual = maker == Maker::kTwk ? kTwkMonoflopMaxUs : kSaaPauseUs;
  ConfigMap monoflop = map.Map("monoflop_us");
  const double min = monoflop.Number("min", min_usual, 0, kMaxUs, "us");
  const double max = monoflop.Number("max", std::max(max_usual, min), min, kMaxUs, "us, at least min");
  monoflop.Done();
  own.line.monoflop = FromUs(min);
  own.monoflop_max = FromUs(max);
}

void ParsePause(ConfigMap& map, SsiBus& own) {
  const double longest = static_cast<double>(own.monoflop_max) / 1e3;
  const double pause = map.Number("pause_us", longest + 1, 0, kMaxUs, "us");
  own.pacing.after_reply = FromUs(pause);
  if (own.pacing.after_reply > own.monoflop_max) return;
  map.Error("pause_us", Text("%g is too short: the encoder takes the next clock for more of the old word until its "
                             "monoflop has run down; above %g us, or set monoflop_us",
                             pause, longest));
}

void ParseCable(ConfigMap& map, Maker maker, SsiBus& own) {
  ClockedLine& line = own.line;
  line.cable_m = map.Number("cable_m", 0, 0, 2'000, "m");
  line.cable_ns_per_m = map.Number("cable_ns_per_m", line.cable_ns_per_m, 3.3, 20, "ns/m");
  line.encoder_delay_ns = map.Number("encoder_delay_ns", line.encoder_delay_ns, 0, 100'000, "ns");
  line.receiver_delay_ns = map.Number("receiver_delay_ns", line.receiver_delay_ns, 0, 100'000, "ns");
  const bool saa = maker == Maker::kSaa;
  line.least_hz = map.Number("min_clock_hz", saa ? kSaaLeastHz : 0, 0, kMaxHz, "Hz");
  line.most_hz = map.Number("max_clock_hz", saa ? kSaaMostHz : kUsualMostHz, 1, kMaxHz, "Hz");
}

std::string LowestText(const SsiBus& own) {
  const bool monoflop = own.line.monoflop > 0 && own.line.least_hz < own.plan.lowest_hz;
  return monoflop ? Text("above %.0f Hz: its cycle must be shorter than the monoflop's %g us", own.plan.lowest_hz,
                         static_cast<double>(own.line.monoflop) / 1e3)
                  : Text("above %.0f Hz: min_clock_hz, from the encoder's data sheet", own.plan.lowest_hz);
}

std::string HighestText(const SsiBus& own) {
  const ClockPlan& plan = own.plan;
  if (plan.highest_half_cycle_hz < plan.highest_hz) {
    return Text(
        "below %.0f Hz: half a cycle must be longer than the %.0f ns that clock and data take over %g m of "
        "cable and through the electronics",
        plan.highest_half_cycle_hz, plan.delay_ns, own.line.cable_m);
  }
  if (plan.highest_hz < own.line.most_hz) {
    return Text("below %.0f Hz: what RS-422 allows over %g m of cable", plan.highest_hz, own.line.cable_m);
  }
  return Text("below %.0f Hz: max_clock_hz, from the encoder's data sheet", plan.highest_hz);
}

void ChooseClock(ConfigMap& map, const BusConfig& bus, SsiBus& own) {
  own.plan = PlanClock(own.line);
  const std::int64_t asked = bus.link.clock_hz;
  own.clock_hz = asked > 0 ? asked : own.plan.half_cycle_hz;
  ConfigMap link = map.Map("link");
  const auto clock = static_cast<double>(own.clock_hz);
  if (own.clock_hz == 0) {
    map.Error("cable_m",
              "no clock is right for this line: " + LowestText(own) + "; but " + HighestText(own) +
                  ". Shorten the cable, or use a controller that delays its reading (axlecast ssi-plan)");
  } else if (clock <= own.plan.lowest_hz) {
    link.Error("clock_hz", std::to_string(asked) + " is too slow, " + LowestText(own));
  } else if (clock >= own.plan.highest_half_cycle_hz) {
    link.Error("clock_hz", std::to_string(asked) + " is too fast, " + HighestText(own));
  }
}

// ---- the word ----

constexpr int kMinPositionBits = 10;
constexpr int kSaaMostBits = 26;  // SAA manual 4.1: "10~26bit"
// Neither the first word nor the tree has room for more: the names of alarms are cut at 24 bytes.
constexpr std::size_t kLongestName = 24;

int ReadInt(ConfigMap& map, std::string_view key, int usual, int min, int max, std::string_view unit) {
  return static_cast<int>(map.Integer(key, usual, min, max, unit));
}

// A bit of the word as the makers' tables number them: from 1, the first that is sent.
int ReadPlace(ConfigMap& map) {
  if (!map.Has("bit"))
    map.Error("bit", "is missing: its number in the data word, from 1, the first bit that is sent");
  return ReadInt(map, "bit", 1, 1, kMaxWordBits, "(from 1, the first bit that is sent)") - 1;
}

void ParsePosition(ConfigMap& device, Maker maker, Format& format) {
  const bool saa = maker == Maker::kSaa;
  const bool tree = device.Choice("format", {"plain", "tree25"}, maker == Maker::kTwk ? 1 : 0) == 1;
  if (!device.Has("bits")) device.Error("bits", "is missing: single-turn bits, as on the encoder's label");
  const int maximum = saa ? kSaaMostBits : tree ? kTreeBits : kMaxPositionBits;
  const int minimum = saa ? kMinPositionBits : 2;
  const char* unit = tree ? "single-turn bits (13 in a word of 25; for more format: plain)" : "single-turn bits";
  const int bits = ReadInt(device, "bits", std::min(12, maximum), minimum, maximum, unit);
  const int most_turns = saa ? 0 : tree ? kTreeTurnBits : kMaxPositionBits - bits;
  const int turn_bits =
      ReadInt(device, "turn_bits", 0, 0, most_turns, saa ? "(SAA encoders are single-turn)" : "multi-turn bits");
  if (tree) {
    const bool gray = format.gray;
    format = TreeFormat(turn_bits, bits);
    format.gray = gray;
    if (device.Has("first_bit")) device.Error("first_bit", "is fixed in format tree25: leave it out");
    return;
  }
  format.turn_bits = turn_bits;
  format.bits = bits;
  format.first = ReadInt(device, "first_bit", 1, 1, kMaxWordBits - turn_bits - bits + 1,
                         "(of the position in the word, from 1)") -
                 1;
  format.word_bits = format.first + turn_bits + bits;
  if (turn_bits + bits < kMinPositionBits) {
    device.Error("bits", Text("%d bits in all are too few: 10 to 32", turn_bits + bits));
  }
}

void ParseCode(ConfigMap& device, Maker maker, Format& format) {
  if (maker == Maker::kCustom && !device.Has("code")) {
    device.Error("code", "is missing: gray or binary, as on the encoder's data sheet");
  }
  format.gray = device.Choice("code", {"binary", "gray"}, maker == Maker::kSaa ? 0 : 1) == 1;
  format.joint = device.Choice("halves", {"joint", "separate"}, 0) == 0;
  if (device.Has("halves") && (!format.gray || format.turn_bits == 0)) {
    device.Error("halves", "has a meaning only with code: gray and turn_bits: leave it out");
  }
}

void ParseRepeat(ConfigMap& device, Maker maker, Format& format) {
  const AfterWord usual = maker == Maker::kSaa ? AfterWord::kWord : AfterWord::kZeroThenWord;
  const std::size_t repeat = device.Choice("repeat", {"none", "one_zero", "no_gap"}, 0);
  format.words = repeat == 0 ? 1 : ReadInt(device, "words", 2, 2, kMaxWords, "words in one transfer");
  if (repeat == 0 && device.Has("words")) device.Error("words", "needs repeat: one_zero or no_gap");
  const AfterWord between = repeat == 1 ? AfterWord::kZeroThenWord : AfterWord::kWord;

  enum Trailing : std::size_t { kZero, kRepeat, kUnchecked };
  const std::size_t usual_check = repeat != 0 ? kRepeat : maker == Maker::kTwk ? kZero : kUnchecked;
  const std::size_t trailing = device.Choice("trailing", {"zero", "repeat", "unchecked"}, usual_check);
  format.trailing_checked = trailing != kUnchecked;
  if (repeat != 0) {
    format.after = between;
    if (trailing == kZero) {
      device.Error("trailing", "zero contradicts repeat: an encoder that repeats its word does not send zeros");
    }
  } else {
    format.after = trailing == kRepeat ? usual : AfterWord::kZeros;
  }
}

// Claims a place for something that is no position. False when it is taken.
bool Claim(ConfigMap& map, int place, const Format& format, std::uint64_t& taken) {
  const int position_end = format.first + format.turn_bits + format.bits;
  const std::uint64_t bit = std::uint64_t{1} << place;
  if (place >= format.first && place < position_end) {
    map.Error("bit",
              Text("%d is a bit of the position (bits %d to %d)", place + 1, format.first + 1, position_end));
    return false;
  }
  if ((taken & bit) != 0) {
    map.Error("bit", Text("%d is taken already", place + 1));
    return false;
  }
  taken |= bit;
  return true;
}

StatusBit ReadStatusBit(const std::string& name, ConfigMap& map) {
  StatusBit bit;
  bit.name = name;
  bit.place = ReadPlace(map);
  bit.active_high = map.Choice("active", {"high", "low"}, 0) == 0;
  bit.is_error = map.Choice("severity", {"error", "warning"}, 0) == 0;
  if (name.size() > kLongestName ||
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos) {
    map.Error("", "'" + name + "' is no name of an alarm: 1 to 24 of a-z, 0-9 and _");
  }
  return bit;
}

// The word includes the bits behind the position.
void Grow(Format& format, int last_place) {
  const int grown = std::max(format.word_bits, last_place + 1);
  format.zeros <<= grown - format.word_bits;
  format.word_bits = grown;
}

void ParseStatus(ConfigMap& device, SsiSettings& settings) {
  Format& format = settings.format;
  std::uint64_t taken = 0;
  int last = 0;
  for (auto& [name, map] : device.Maps("status_bits")) {
    StatusBit bit = ReadStatusBit(name, map);
    if (Claim(map, bit.place, format, taken)) last = std::max(last, bit.place);
    map.Done();
    settings.status_bits.push_back(std::move(bit));
  }
  if (settings.status_bits.size() > kMaxStatusBits) {
    device.Error("status_bits", Text("%zu are too many: at most 8", settings.status_bits.size()));
  }
  if (device.Has("parity")) {
    ConfigMap map = device.Map("parity");
    settings.parity_place = ReadPlace(map);
    if (!map.Has("sense")) map.Error("sense", "is missing: even or odd number of ones in the whole word");
    format.parity = map.Choice("sense", {"even", "odd"}, 0) == 0 ? ParityRule::kEven : ParityRule::kOdd;
    if (Claim(map, settings.parity_place, format, taken)) last = std::max(last, settings.parity_place);
    map.Done();
  }
  Grow(format, last);
  const int word_bits = ReadInt(device, "word_bits", format.word_bits, format.word_bits, kMaxWordBits,
                                "bits, no fewer than position and status bits need");
  Grow(format, word_bits - 1);
  for (int place = 0; place < format.word_bits; ++place) {
    if ((taken >> place & 1) != 0) format.zeros &= ~PlaceMask(format, place, 1);
  }
}

void ParseOnes(ConfigMap& device, Format& format) {
  format.ones_are_position = device.Choice("all_ones", {"no_encoder", "position"}, 0) == 1;
  if (!format.ones_are_position) return;
  const bool zero_after = format.after != AfterWord::kWord && (format.words > 1 || format.trailing_checked);
  if (format.zeros != 0 || zero_after)
    device.Error("all_ones", "has no effect: with this word or trailing a zero must always come");
}

// Reads the keys of a device that define its word: README.md, "The word". Errors go into the map's list. The rest can be
// decoded all the same.
void ParseWordKeys(ConfigMap& device, Maker maker, SsiSettings& settings) {
  ParsePosition(device, maker, settings.format);
  ParseCode(device, maker, settings.format);
  ParseRepeat(device, maker, settings.format);
  ParseStatus(device, settings);
  ParseOnes(device, settings.format);
}

// In device order: saa and its sizes, twk, custom.
const std::vector<std::string_view>& ModelNames() {
  static const std::vector<std::string_view> kNames = [] {
    std::vector<std::string_view> names(saa::kModels.begin(), saa::kModels.end());
    names.insert(names.end(), {"twk", "custom"});
    return names;
  }();
  return kNames;
}

}  // namespace

Maker MakerOf(std::string_view model) {
  if (model == "twk") return Maker::kTwk;
  return model == "custom" ? Maker::kCustom : Maker::kSaa;
}

std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus) {
  auto own = std::make_shared<SsiBus>();
  const Maker maker = PeekMaker(map);
  ParseMonoflop(map, maker, *own);
  ParsePause(map, *own);
  ParseCable(map, maker, *own);
  ChooseClock(map, bus, *own);
  return own;
}

std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus) {
  const SsiBus& own = OwnBus(bus);
  auto settings = std::make_unique<SsiSettings>();
  if (!device.Has("model")) {
    device.Error("model", "is missing: saa, twk, or custom with code and, at the bus, monoflop_us");
  }
  settings->model = ModelNames().at(device.Choice("model", ModelNames(), 0));
  const Maker maker = MakerOf(settings->model);
  ParseWordKeys(device, maker, *settings);
  const Format& format = settings->format;
  settings->counts_per_turn = std::int64_t{1} << format.bits;
  settings->turns_range = format.turn_bits == 0 ? 0 : std::int64_t{1} << format.turn_bits;
  settings->confirmations_after_jump = kReadingsToBelieve;
  settings->max_speed_rpm = saa::kMaxSpeedRpm;
  settings->noise_counts = maker == Maker::kSaa ? saa::NoiseCounts(format.bits) : 1;
  if (maker != Maker::kSaa) {
    settings->max_speed_rpm = device.Number("max_speed_rpm", kUsualMaxRpm, 1, 100'000, "rpm");
  } else if (device.Has("max_speed_rpm")) {
    device.Error("max_speed_rpm", "is known of model " + settings->model + ": 5000; for less use limits");
  }
  settings->spi = {.mode = 2, .clock_hz = own.clock_hz};
  const auto clocks = static_cast<std::int64_t>(TransferSize(format)) * 8;
  settings->wire_time = settings->spi.ClockTime(clocks) + own.pacing.after_reply;
  return settings;
}

const SsiBus& OwnBus(const BusConfig& bus) { return static_cast<const SsiBus&>(*bus.family_bus); }
const SsiSettings& Own(const DeviceConfig& device) { return static_cast<const SsiSettings&>(*device.settings); }

}  // namespace axlecast::ssi
