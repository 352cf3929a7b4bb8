#include "drivers/ssi/codec.h"

#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "drivers/ssi/test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::ssi {
namespace {

Word Transfer(const std::string& levels, const Format& format) {
  const ClockedBits bits(levels);
  return ParseTransfer(bits.bytes, bits.count, format);
}

// TWK SSI 5, the table row by row: each bit alone represents its power of two, and a place that shows 0 must be 0.
TEST(SsiCodec, EveryRowOfTheTreeTable) {
  int rows = 0;
  for (const GoldenRow& row : GoldenRows(__FILE__, "tree.txt", 3)) {
    ++rows;
    const int turn_bits = std::stoi(row.columns[0]);
    const int bits = std::stoi(row.columns[1]);
    const Format format = TreeFormat(turn_bits, bits);
    ASSERT_EQ(format.word_bits, 25);
    std::istringstream cells(row.columns[2]);
    std::string cell;
    for (int place = 0; cells >> cell; ++place) {
      const Word word = ParseWord(std::uint64_t{1} << (24 - place), format);
      if (cell == "0") {
        EXPECT_EQ(word.error, WordError::kPadding) << row.where << " bit " << place + 1;
        continue;
      }
      const std::uint32_t value = 1U << (std::stoul(cell.substr(1)) - 1);
      EXPECT_EQ(word.error, WordError::kNone) << row.where;
      EXPECT_EQ(word.turns, cell[0] == 'M' ? value : 0) << row.where << ' ' << cell;
      EXPECT_EQ(word.counts, cell[0] == 'S' ? value : 0) << row.where << ' ' << cell;
    }
  }
  EXPECT_EQ(rows, 12);
}

// Gray code, from its definition: one bit differs between neighbours, and every code occurs once.
TEST(SsiCodec, GrayNeighboursDifferInOneBit) {
  const Format format = {.word_bits = 12, .bits = 12, .gray = true};
  std::vector<std::uint32_t> code_of(1U << 12U, 0);
  for (std::uint32_t code = 0; code < code_of.size(); ++code) code_of.at(ParseWord(code, format).counts) = code;
  EXPECT_EQ(code_of[0], 0U);
  for (std::size_t i = 1; i < code_of.size(); ++i) {
    EXPECT_EQ(__builtin_popcount(code_of[i] ^ code_of[i - 1]), 1) << i;
  }
  const Format longest = {.word_bits = 32, .bits = 32, .gray = true};
  EXPECT_EQ(ParseWord(0x8000'0000U, longest).counts, 0xFFFF'FFFFU);
}

// Status bits before the position are no turns, and each part has its own Gray code if they are not joint.
TEST(SsiCodec, TurnsAndPositionEachInGrayCodeBehindStatusBits) {
  const Format format = {.word_bits = 12, .first = 2, .turn_bits = 4, .bits = 6, .gray = true, .joint = false};
  const Word word = ParseWord(0b11'0110'001101, format);
  EXPECT_EQ(word.turns, 4U);
  EXPECT_EQ(word.counts, 9U);
  EXPECT_EQ(ParseWord(0b11'0000'000000, {.word_bits = 12, .first = 2, .turn_bits = 4, .bits = 6}).turns, 0U);
}

TEST(SsiCodec, ATransferHasNoMoreClocksThanItsBytes) {
  const Format format = {.word_bits = 15, .bits = 15};
  const std::vector<std::uint8_t> bytes = {0x80, 0x01};
  EXPECT_EQ(ParseTransfer(bytes, 16, format).error, WordError::kNone);
  EXPECT_EQ(ParseTransfer(bytes, 17, format).error, WordError::kShort);
}

// Converting the padding too would give copies of the last bit behind it.
TEST(SsiCodec, OnlyTheUsedBitsAreConverted) {
  Format format = TreeFormat(8, 10);
  format.gray = true;
  const Word word = ParseWord(std::uint64_t{1} << 3U, format);  // S1 alone
  EXPECT_EQ(word.error, WordError::kNone);
  EXPECT_EQ(word.counts, 1U);
  EXPECT_EQ(word.turns, 0U);
}

// TWK SSI 2: "a clock sequence of n + 1 cycles is needed to transmit a data word with n bits".
TEST(SsiCodec, ClocksOfATransfer) {
  EXPECT_EQ(TransferSize({.word_bits = 12}), 2U);                            // 13 clocks
  EXPECT_EQ(TransferSize({.word_bits = 15}), 2U);                            // 16
  EXPECT_EQ(TransferSize({.word_bits = 15, .trailing_checked = true}), 3U);  // one more to look at
  EXPECT_EQ(TransferSize({.word_bits = 25}), 4U);
  EXPECT_EQ(TransferSize({.word_bits = 25, .words = 2, .after = AfterWord::kZeroThenWord}), 7U);  // 52
  EXPECT_EQ(
      TransferSize({.word_bits = 48, .words = 4, .after = AfterWord::kZeroThenWord, .trailing_checked = true}),
      kMaxTransfer);
}

constexpr Format kTwelve = {.word_bits = 12, .bits = 12};

// SAA manual 5.5: the line is high until the first falling edge; the extra clocks repeat the high-order data.
TEST(SsiCodec, TheExampleOf495BehindTheIdleLevel) {
  const Word word = Transfer("1 000111101111 000", kTwelve);
  EXPECT_EQ(word.error, WordError::kNone);
  EXPECT_EQ(word.counts, 495U);
}

TEST(SsiCodec, WhatTheLineItselfShows) {
  EXPECT_EQ(Transfer("0 000111101111 000", kTwelve).error, WordError::kIdleLow);
  EXPECT_EQ(Transfer("0 000000000000 000", kTwelve).error, WordError::kIdleLow);  // stuck low
  EXPECT_EQ(Transfer("1 111111111111 111", kTwelve).error, WordError::kNoZero);   // no encoder
  EXPECT_EQ(Transfer("1 111111111111 110", kTwelve).counts, 4095U);
  EXPECT_EQ(Transfer("1 000000000000 000", kTwelve).error, WordError::kNone);
  EXPECT_EQ(Transfer("1 00011110111", kTwelve).error, WordError::kShort);
  EXPECT_EQ(ParseTransfer({}, 0, kTwelve).error, WordError::kShort);
  EXPECT_EQ(ParseTransfer(ClockedBits("1000").bytes, 99, kTwelve).error, WordError::kShort);
  Format ones = kTwelve;
  ones.ones_are_position = true;
  EXPECT_EQ(Transfer("1 111111111111 111", ones).counts, 4095U);
}

TEST(SsiCodec, WhatFollowsTheWord) {
  Format zeros = kTwelve;
  zeros.trailing_checked = true;
  EXPECT_EQ(Transfer("1 100111101111 000", zeros).error, WordError::kNone);
  EXPECT_EQ(Transfer("1 100111101111 001", zeros).error, WordError::kTrailing);
  EXPECT_EQ(Transfer("1 111111111111 111", zeros).error, WordError::kNoZero);
  Format one_zero = zeros;
  one_zero.after = AfterWord::kZeroThenWord;
  EXPECT_EQ(Transfer("1 100111101111 010", one_zero).error, WordError::kNone);
  EXPECT_EQ(Transfer("1 100111101111 000", one_zero).error, WordError::kTrailing);
  EXPECT_EQ(Transfer("1 100111101111 100", one_zero).error, WordError::kTrailing);
  Format at_once = zeros;
  at_once.after = AfterWord::kWord;
  EXPECT_EQ(Transfer("1 100111101111 100", at_once).error, WordError::kNone);
  EXPECT_EQ(Transfer("1 100111101111 010", at_once).error, WordError::kTrailing);
}

// TWK SSI 7: the same word again after a zero, any number of times. Every inverted bit of two words shows, but a pair of
// the same place.
TEST(SsiCodec, WordsOfOneTransferAreCompared) {
  const Format format = {
      .word_bits = 12, .bits = 12, .words = 2, .after = AfterWord::kZeroThenWord, .trailing_checked = true};
  const std::string good = "1 100111101111 0 100111101111 0 10011";
  EXPECT_EQ(Transfer(good, format).counts, 0b100111101111U);
  const ClockedBits bits(good);
  for (std::size_t i = 0; i < bits.count; ++i) {
    std::vector<std::uint8_t> bytes = bits.bytes;
    bytes[i / 8] = static_cast<std::uint8_t>(bytes[i / 8] ^ 0x80U >> i % 8);
    EXPECT_NE(ParseTransfer(bytes, bits.count, format).error, WordError::kNone) << i;
  }
  EXPECT_EQ(Transfer("1 100111101110 0 100111101110 0 10011", format).counts, 0b100111101110U);
}

TEST(SsiCodec, ThreeWordsWithoutAZeroBetween) {
  const Format format = {.word_bits = 10, .bits = 10, .words = 3, .after = AfterWord::kWord};
  EXPECT_EQ(Transfer("1 1000000001 1000000001 1000000001 1111", format).counts, 513U);
  EXPECT_EQ(Transfer("1 1000000001 1000000001 1000000000 1111", format).error, WordError::kRepeat);
}

TEST(SsiCodec, ParityOverTheWholeWord) {
  Format even = {.word_bits = 13, .bits = 12, .parity = ParityRule::kEven};
  EXPECT_EQ(ParseWord(0b0001111011110, even).counts, 495U);  // eight ones
  EXPECT_EQ(ParseWord(0b0001111011111, even).error, WordError::kParity);
  even.parity = ParityRule::kOdd;
  EXPECT_EQ(ParseWord(0b0001111011111, even).error, WordError::kNone);
  EXPECT_EQ(ParseWord(0b0001111011110, even).error, WordError::kParity);
}

// TWK SSI 2: "data words of any desired length": 10 to 32 bits of position at any place in the word.
TEST(SsiCodec, EveryLengthAndPlace) {
  std::mt19937_64 random(4);
  for (int bits = 10; bits <= kMaxPositionBits; ++bits) {
    for (int first = 0; first + bits <= kMaxWordBits; first += 3) {
      const std::uint64_t value = random() & ((std::uint64_t{1} << bits) - 1);
      const Format format = {.word_bits = kMaxWordBits, .first = first, .bits = bits};
      const std::uint64_t word = value << (kMaxWordBits - first - bits);
      EXPECT_EQ(ParseWord(word, format).counts, value);
      EXPECT_EQ(PlaceMask(format, first, bits) & word, word);
    }
  }
}

}  // namespace
}  // namespace axlecast::ssi
