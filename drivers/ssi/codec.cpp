#include "drivers/ssi/codec.h"

#include <array>
#include <bit>

#include "drivers/kit/clocked_line.h"

namespace axlecast::ssi {
namespace {

constexpr std::size_t kIdle = 1;  // samples before the word

std::size_t GapOf(const Format& format) { return format.after == AfterWord::kZeroThenWord ? 1 : 0; }

std::size_t WordClocks(const Format& format) {
  const auto words = static_cast<std::size_t>(format.words);
  return kIdle + words * static_cast<std::size_t>(format.word_bits) + (words - 1) * GapOf(format);
}

bool AllOnes(Bytes bytes, std::size_t bit_count) {
  for (std::size_t i = 0; i < bit_count; ++i) {
    if (!BitAt(bytes, i)) return false;
  }
  return true;
}

// What the encoder shows so many clocks after its word.
bool Behind(const Format& format, std::uint64_t word, std::size_t clocks) {
  if (format.after == AfterWord::kZeros) return false;
  const std::size_t gap = GapOf(format);
  const std::size_t place = clocks % (static_cast<std::size_t>(format.word_bits) + gap);
  return place >= gap && PlaceOf(format, word, static_cast<int>(place - gap));
}

// The first thing that is wrong behind the first word.
WordError CheckBehind(Bytes bytes, std::size_t bit_count, const Format& format, std::uint64_t word) {
  const std::size_t begin = kIdle + static_cast<std::size_t>(format.word_bits);
  const std::size_t compared = WordClocks(format);
  const std::size_t end = format.trailing_checked ? bit_count : compared;
  for (std::size_t i = begin; i < end; ++i) {
    if (BitAt(bytes, i) == Behind(format, word, i - begin)) continue;
    return i < compared ? WordError::kRepeat : WordError::kTrailing;
  }
  return WordError::kNone;
}

bool ParityHolds(std::uint64_t value, ParityRule rule) {
  if (rule == ParityRule::kNone) return true;
  return (std::popcount(value) % 2 == 1) == (rule == ParityRule::kOdd);
}

std::uint32_t LowBits(std::uint32_t value, int count) {
  return count >= 32 ? value : value & ((1U << static_cast<unsigned>(count)) - 1);
}

}  // namespace

Format TreeFormat(int turn_bits, int bits) {
  Format format;
  format.word_bits = kTreeTurnBits + kTreeBits;
  format.first = kTreeTurnBits - turn_bits;
  format.turn_bits = turn_bits;
  format.bits = bits;
  format.zeros = PlaceMask(format, 0, format.first) | PlaceMask(format, kTreeTurnBits + bits, kTreeBits - bits);
  return format;
}

std::size_t TransferSize(const Format& format) {
  const std::size_t over = format.trailing_checked ? 1 : 0;
  return (WordClocks(format) + over + 7) / 8;
}

const char* WordErrorName(WordError error) {
  constexpr std::array kNames = {"none",   "short",    "line_low", "all_ones",
                                 "repeat", "trailing", "range",    "checksum"};
  return kNames.at(static_cast<std::size_t>(error));
}

Word ParseWord(std::uint64_t value, const Format& format) {
  Word word;
  word.value = value;
  if ((value & format.zeros) != 0) {
    word.error = WordError::kPadding;
    return word;
  }
  if (!ParityHolds(value, format.parity)) {
    word.error = WordError::kParity;
    return word;
  }
  const int used = format.turn_bits + format.bits;
  auto position = static_cast<std::uint32_t>(value >> (format.word_bits - format.first - used));
  position = LowBits(position, used);
  if (format.gray && format.joint) position = GrayToBinary(position);
  word.counts = LowBits(position, format.bits);
  word.turns = format.turn_bits == 0 ? 0 : position >> static_cast<unsigned>(format.bits);
  if (format.gray && !format.joint) {
    word.counts = GrayToBinary(word.counts);
    word.turns = GrayToBinary(word.turns);
  }
  return word;
}

Word ParseTransfer(Bytes bytes, std::size_t bit_count, const Format& format) {
  if (bit_count < WordClocks(format) || bit_count > bytes.size() * 8) return {.error = WordError::kShort};
  if (!BitAt(bytes, 0)) return {.error = WordError::kIdleLow};
  if (!format.ones_are_position && AllOnes(bytes, bit_count)) return {.error = WordError::kNoZero};
  const std::uint64_t value = BitsAt(bytes, kIdle, static_cast<std::size_t>(format.word_bits));
  const WordError behind = CheckBehind(bytes, bit_count, format, value);
  if (behind != WordError::kNone) return {.error = behind, .value = value};
  return ParseWord(value, format);
}

}  // namespace axlecast::ssi
