#include "drivers/ssi/family.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/family.h"
#include "core/device/operation.h"
#include "drivers/kit/clocked_line.h"
#include "drivers/kit/decode.h"
#include "drivers/ssi/codec.h"
#include "drivers/ssi/settings.h"

namespace axlecast::ssi {
namespace {

// What the settings define of a word.
struct DecodeOptions {
  Format format;
  std::vector<StatusBit> status_bits;
  std::optional<std::size_t> bit_count;  // of the frame; nothing: all bits of its bytes
};

constexpr std::int64_t kMaxFrameBits = 1'000'000;

// The settings as they were given; the later of two of one key wins, but for status.
struct Given {
  std::optional<std::int64_t> bits;
  std::int64_t turn_bits = 0;
  std::int64_t first_bit = 1;
  std::int64_t word_bits = 0;  // 0: as many as the rest needs
  std::int64_t words = 2;
  std::int64_t gray = 0;
  std::int64_t separate = 0;
  std::int64_t tree = 0;
  std::int64_t repeat = 0;
  std::int64_t trailing = 2;
  std::int64_t ones_are_position = 0;
  std::int64_t parity_place = -1;
  ParityRule parity = ParityRule::kNone;
};

std::optional<std::int64_t> ReadPlace(std::string_view text) {
  const std::optional<std::int64_t> number = ParseWhole(text, 1, kMaxWordBits);
  return number ? std::optional(*number - 1) : std::nullopt;
}

// "even:26"
bool ReadParity(std::string_view value, Given& given) {
  const std::size_t colon = std::min(value.find(':'), value.size());
  const std::string_view sense = value.substr(0, colon);
  const auto place = ReadPlace(colon < value.size() ? value.substr(colon + 1) : "");
  if (!place || (sense != "even" && sense != "odd")) return false;
  given.parity = sense == "even" ? ParityRule::kEven : ParityRule::kOdd;
  given.parity_place = *place;
  return true;
}

// "alarm:25" or "alarm:25:low"
bool ReadStatus(std::string_view value, std::vector<StatusBit>& bits) {
  const std::size_t first = std::min(value.find(':'), value.size());
  const std::size_t second = std::min(value.find(':', first + 1), value.size());
  const std::string_view active = second < value.size() ? value.substr(second + 1) : "high";
  const auto place = ReadPlace(first < value.size() ? value.substr(first + 1, second - first - 1) : "");
  if (first == 0 || !place || (active != "high" && active != "low") || bits.size() == kMaxStatusBits) return false;
  bits.push_back({std::string(value.substr(0, first)), static_cast<int>(*place), active == "high", true});
  return true;
}

Result<> ReadGiven(const DecodeSettings& settings, Given& given, DecodeOptions& options) {
  const std::array<DecodeOption, 14> known = {
      {NumberOption("bits", given.bits, 1, kMaxPositionBits, "single-turn bits"),
       NumberOption("turn_bits", given.turn_bits, 0, kMaxPositionBits - 1, "multi-turn bits"),
       ChoiceOption("gray", given.gray, {"false", "true"}),
       ChoiceOption("halves", given.separate, {"joint", "separate"}),
       ChoiceOption("format", given.tree, {"plain", "tree25"}),
       NumberOption("first_bit", given.first_bit, 1, kMaxWordBits, "the position's first bit in the word, from 1"),
       NumberOption("word_bits", given.word_bits, 1, kMaxWordBits, "length of the word"),
       ChoiceOption("repeat", given.repeat, {"none", "one_zero", "no_gap"}),
       NumberOption("words", given.words, 2, kMaxWords, "words in one transfer, with repeat"),
       ChoiceOption("trailing", given.trailing, {"zero", "repeat", "unchecked"}),
       ChoiceOption("all_ones", given.ones_are_position, {"no_encoder", "position"}),
       {"status", "NAME:BIT or NAME:BIT:low, at most 8 of them; BIT is its number in the word",
        [&](const std::string& value) { return ReadStatus(value, options.status_bits); }},
       {"parity", "even:BIT or odd:BIT, its number in the word from 1",
        [&](const std::string& value) { return ReadParity(value, given); }},
       NumberOption("bit_count", options.bit_count, 0, kMaxFrameBits, "bits of the frame")}};
  return ApplySettings("ssi", settings, known);
}

// If the length of the word is not given, all bits of the frame are the word.
std::int64_t BitsOf(const Given& given, const DecodeOptions& options) {
  if (given.bits) return *given.bits;
  const auto count = static_cast<std::int64_t>(options.bit_count.value_or(0));
  return std::clamp<std::int64_t>(count - given.turn_bits, 1, kMaxPositionBits - given.turn_bits);
}

Result<> MakeFormat(const Given& given, DecodeOptions& options) {
  Format& format = options.format;
  const auto bits = static_cast<int>(BitsOf(given, options));
  const auto turn_bits = static_cast<int>(given.turn_bits);
  if (turn_bits + bits > kMaxPositionBits) return Failure("turn_bits and bits: expected at most 32 together");
  const bool tree = given.tree == 1;
  if (tree && (turn_bits > kTreeTurnBits || bits > kTreeBits)) {
    return Failure("format=tree25: expected turn_bits up to 12 and bits up to 13");
  }
  if (tree) {
    format = TreeFormat(turn_bits, bits);
  } else {
    format.turn_bits = turn_bits;
    format.bits = bits;
    format.first = static_cast<int>(given.first_bit) - 1;
    format.word_bits = format.first + turn_bits + bits;
  }
  std::int64_t needed = std::max<std::int64_t>(format.word_bits, given.parity_place + 1);
  for (const StatusBit& bit : options.status_bits) needed = std::max<std::int64_t>(needed, bit.place + 1);
  if (given.word_bits != 0 && given.word_bits < needed) {
    return Failure("word_bits=" + std::to_string(given.word_bits) + ": expected at least " +
                   std::to_string(needed));
  }
  const auto length = static_cast<int>(std::max(needed, given.word_bits));
  if (length > kMaxWordBits)
    return Failure("the word would have " + std::to_string(length) + " bits: expected at most 48");
  format.zeros <<= length - format.word_bits;
  format.word_bits = length;
  for (const StatusBit& bit : options.status_bits) format.zeros &= ~PlaceMask(format, bit.place, 1);
  if (given.parity_place >= 0) format.zeros &= ~PlaceMask(format, static_cast<int>(given.parity_place), 1);
  return {};
}

void SetRules(const Given& given, Format& format) {
  format.gray = given.gray == 1;
  format.joint = given.separate == 0;
  format.parity = given.parity;
  format.ones_are_position = given.ones_are_position == 1;
  format.words = given.repeat == 0 ? 1 : static_cast<int>(given.words);
  format.trailing_checked = given.trailing != 2;
  // Behind one word alone, "repeat" is TWK's: a zero, then the word.
  const bool zeros = given.repeat == 0 && given.trailing == 0;
  const bool at_once = given.repeat == 2;
  format.after = zeros ? AfterWord::kZeros : at_once ? AfterWord::kWord : AfterWord::kZeroThenWord;
}

Result<DecodeOptions> ReadDecodeOptions(const DecodeSettings& settings) {
  DecodeOptions options;
  Given given;
  if (const Result<> read = ReadGiven(settings, given, options); !read) return Failure(read.error());
  if (!given.bits && !options.bit_count) {
    return Failure("bits=: expected 1..32, single-turn bits: a word does not contain their number");
  }
  if (given.repeat != 0 && given.trailing == 0) {
    return Failure("trailing=zero: expected repeat or unchecked with repeat");
  }
  if (Result<> made = MakeFormat(given, options); !made) return Failure(made.error());
  SetRules(given, options.format);
  return options;
}

using Json = nlohmann::ordered_json;

// A frame of exactly the word's length, as documents print words, is the word; any other begins with the idle level
// that the first clock samples.
Word Parse(Bytes frame, const DecodeOptions& options) {
  const auto length = static_cast<std::size_t>(options.format.word_bits);
  const std::size_t count = options.bit_count.value_or(frame.size() * 8);
  if (count > frame.size() * 8) return {.error = WordError::kShort};
  if (options.bit_count && count == length) return ParseWord(BitsAt(frame, 0, length), options.format);
  return ParseTransfer(frame, count, options.format);
}

}  // namespace

Result<Json> Decode(const DecodeSettings& settings, Bytes frame) {
  const Result<DecodeOptions> read = ReadDecodeOptions(settings);
  if (!read) return Failure(read.error());
  const DecodeOptions& options = *read;
  const Word word = Parse(frame, options);
  Json json = {{"ok", word.error == WordError::kNone}, {"kind", "position_word"}};
  if (word.error != WordError::kNone) {
    json["error"] = WordErrorName(word.error);
    return json;
  }
  json["counts"] = word.counts;
  if (options.format.turn_bits > 0) json["turns"] = word.turns;
  json["angle_deg"] = Degrees(word.counts, options.format.bits);
  if (options.status_bits.empty()) return json;
  json["alarms"] = Json::array();
  for (const StatusBit& bit : options.status_bits) {
    if (PlaceOf(options.format, word.value, bit.place) == bit.active_high) json["alarms"].push_back(bit.name);
  }
  return json;
}

}  // namespace axlecast::ssi
