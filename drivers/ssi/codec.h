#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/inline_bytes.h"

namespace axlecast::ssi {

// What an encoder sends if the clock continues after its word.
enum class AfterWord : std::uint8_t {
  kZeros,         // zeros for ever (TWK SSI 4, "Alternatively"; 6)
  kZeroThenWord,  // one zero, then the same word again, and so on (TWK SSI 4, 7)
  kWord,          // the same word at once (SAA manual 5.5: "repeat the high-order data")
};

enum class ParityRule : std::uint8_t { kNone, kEven, kOdd };

// How a word is made up. Places in a word count from 0; the first bit that comes is the most significant.
struct Format {
  int word_bits = 12;  // data word: position, padding, status bits
  int first = 0;       // place of the position
  int turn_bits = 0;   // multi-turn part, before the single-turn part
  int bits = 12;       // single-turn part
  bool gray = false;
  bool joint = true;        // one Gray code over both parts; false: one each
  std::uint64_t zeros = 0;  // places that are always 0, as a mask of the word's value
  int words = 1;            // read in one transfer, and compared; above 1, `after` states what is between them
  AfterWord after = AfterWord::kZeros;
  bool trailing_checked = false;          // the clocks behind the last word must show what `after` states
  ParityRule parity = ParityRule::kNone;  // over the whole word
  bool ones_are_position = false;         // a transfer of ones alone is a position, not a wire without an encoder
};
inline constexpr int kMaxPositionBits = 32;
inline constexpr int kMaxWordBits = 48;
inline constexpr int kMaxWords = 4;

// TWK SSI 5: the tree of 25 bits, 12 for the revolutions and 13 for the position in one. Fewer multi-turn bits are
// preceded by zeros, fewer single-turn bits are followed by zeros.
inline constexpr int kTreeTurnBits = 12;
inline constexpr int kTreeBits = 13;
[[nodiscard]] Format TreeFormat(int turn_bits, int bits);

// Places `first` to `first + count - 1` as a mask of the word's value.
[[nodiscard]] constexpr std::uint64_t PlaceMask(const Format& format, int first, int count) {
  const std::uint64_t ones = (std::uint64_t{1} << count) - 1;
  return ones << (format.word_bits - first - count);
}
[[nodiscard]] constexpr bool PlaceOf(const Format& format, std::uint64_t word, int place) {
  return (word & PlaceMask(format, place, 1)) != 0;
}

// Bytes of one transfer: the idle level that the first falling edge samples, the words, and one more clock where what
// follows is checked; rounded up to whole bytes.
[[nodiscard]] std::size_t TransferSize(const Format& format);
inline constexpr std::size_t kMaxTransfer = (1 + kMaxWords * (kMaxWordBits + 1) + 7) / 8;

enum class WordError : std::uint8_t {
  kNone,
  kShort,     // fewer bits than the words have
  kIdleLow,   // the line was not high before the clock began
  kNoZero,    // nothing but ones: no encoder, no power, a cut wire
  kRepeat,    // the words of one transfer differ
  kTrailing,  // what follows the word is not what the encoder sends there
  kPadding,   // a place that is always 0 is not
  kParity,
};
[[nodiscard]] const char* WordErrorName(WordError error);

struct Word {
  WordError error = WordError::kNone;
  std::uint64_t value = 0;   // as sent
  std::uint32_t counts = 0;  // single-turn
  std::uint32_t turns = 0;   // multi-turn
};

// What was clocked in, from the idle level on; `bit_count` of its bits count.
[[nodiscard]] Word ParseTransfer(Bytes bytes, std::size_t bit_count, const Format& format);
// One word alone, without what is around it.
[[nodiscard]] Word ParseWord(std::uint64_t value, const Format& format);

[[nodiscard]] constexpr std::uint32_t GrayToBinary(std::uint32_t gray) {
  for (unsigned shift = 1; shift < 32; shift *= 2) gray ^= gray >> shift;
  return gray;
}

}  // namespace axlecast::ssi
