#include "drivers/ssi/decode.h"

#include <nlohmann/json.hpp>
#include <string>

#include "core/device/operation.h"
#include "drivers/kit/bits.h"
#include "drivers/ssi/decode_options.h"

namespace axlecast::ssi {
namespace {

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

Json Decode(const DecodeSettings& settings, Bytes frame, bool* usable) {
  DecodeOptions options;
  const std::string problem = ReadDecodeOptions(settings, options);
  *usable = problem.empty();
  if (!*usable) return {{"error", problem}};
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
