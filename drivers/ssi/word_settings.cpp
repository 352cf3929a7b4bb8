#include "drivers/ssi/word_settings.h"

#include <algorithm>
#include <array>
#include <optional>

#include "core/config/config_map.h"
#include "core/device/operation.h"

namespace axlecast::ssi {
namespace {

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
      device.Error("trailing", "zero contradicts repeat: an encoder that repeats its word goes on repeating it");
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

// The word grows over what stands behind the position.
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

}  // namespace

void ParseWordKeys(ConfigMap& device, Maker maker, SsiSettings& settings) {
  ParsePosition(device, maker, settings.format);
  ParseCode(device, maker, settings.format);
  ParseRepeat(device, maker, settings.format);
  ParseStatus(device, settings);
  ParseOnes(device, settings.format);
}

}  // namespace axlecast::ssi
