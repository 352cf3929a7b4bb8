#include "drivers/biss/crc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "drivers/biss/bits_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::biss {
namespace {

std::string Check(const CrcRule& rule, std::uint64_t value, int count) {
  return TextOf(Crc(rule).Of(value, count), rule.bits);
}

// 5.6: 100010101110001110 has the CRC 110101, in negative logic 001010.
TEST(BissCrc, TheManualsExample) {
  EXPECT_EQ(Check({}, 0b10'0010'1011'1000'1110, 18), "001010");
  EXPECT_EQ(Check({.inverted = false}, 0b10'0010'1011'1000'1110, 18), "110101");
  EXPECT_EQ(NaiveCrc("100010101110001110", 0x43, 6, 0, true), "001010") << "the tests' own";
}

TEST(BissCrc, TheTableOfAnotherMaker) {
  std::uint64_t value = 0;
  for (const GoldenRow& row : GoldenRows(__FILE__, "crc6_table.txt", 1)) {
    for (const std::uint8_t remainder : GoldenBytes(row.columns[0])) {
      EXPECT_EQ(Crc({.inverted = false}).Of(value, 6), remainder) << value;
      ++value;
    }
  }
  EXPECT_EQ(value, 64U);
}

// mjbots/moteus fw/test/bissc_extract_test.cc, BisscCrcBasic.
TEST(BissCrc, AValueOfAnotherProgram) { EXPECT_EQ(Crc({.inverted = false}).Of(0x1234, 16), 56U); }

TEST(BissCrc, EveryWidthLengthAndStartAsTheNaiveOne) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 20'000; ++i) {
    CrcRule rule;
    rule.bits = static_cast<int>(kMinCrcBits + static_cast<int>(random() % (kMaxCrcBits - kMinCrcBits + 1)));
    const std::uint32_t highest = 1U << static_cast<unsigned>(rule.bits);
    rule.polynomial = highest | (static_cast<std::uint32_t>(random()) & (highest - 1)) | 1U;
    rule.start = static_cast<std::uint32_t>(random()) & (highest - 1);
    rule.inverted = random() % 2 == 0;
    const int count = static_cast<int>(random() % 65);
    const std::uint64_t value = random();
    ASSERT_EQ(Check(rule, value, count),
              NaiveCrc(TextOf(value, count), rule.polynomial, rule.bits, rule.start, rule.inverted))
        << rule.bits << ' ' << count;
  }
}

// CRC-6/G-704 takes its input and gives its remainder least significant bit first.
std::uint32_t G704(const std::vector<bool>& bits) {
  std::uint32_t remainder = 0;
  for (const bool bit : bits) {
    const bool out = (remainder & 1U) != bit;
    remainder = remainder >> 1U ^ (out ? 0x30U : 0U);
  }
  return remainder;
}

TEST(BissCrc, IsNotG704) {
  std::vector<bool> digits;
  for (const char digit : std::string("123456789")) {
    for (unsigned i = 0; i < 8; ++i) digits.push_back((static_cast<unsigned>(digit) >> i & 1U) != 0);
  }
  ASSERT_EQ(G704(digits), 0x06U) << "its check value: this is that algorithm";
  // Ours agrees with every frame of others. By chance G-704 agrees with one order of the bits on single frames, the
  // manual's example among them: not on all.
  int first_to_last = 0;
  int last_to_first = 0;
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 4)) {
    std::vector<bool> bits;
    for (const char digit : row.columns[1]) {
      if (digit != ' ') bits.push_back(digit == '1');
    }
    std::uint32_t sent = 0;
    for (std::size_t i = bits.size() - 6; i < bits.size(); ++i) sent = sent << 1U | (bits[i] ? 0U : 1U);
    bits.resize(bits.size() - 6);
    std::uint64_t covered = 0;
    for (const bool bit : bits) covered = covered << 1U | (bit ? 1U : 0U);
    EXPECT_EQ(Crc({.inverted = false}).Of(covered, static_cast<int>(bits.size())), sent) << row.where;
    first_to_last += G704(bits) == sent ? 0 : 1;
    std::reverse(bits.begin(), bits.end());
    last_to_first += G704(bits) == sent ? 0 : 1;
  }
  EXPECT_GE(first_to_last, 3);
  EXPECT_GE(last_to_first, 3);
}

// Two wrong bits of a frame are seen however far apart they are (up to 63 bits: the order of x); so is every burst of
// six.
TEST(BissCrc, SeesEveryTwoBitsAndEveryBurst) {
  const Crc crc({});
  const std::uint32_t none = crc.Of(0, 56);
  const auto wrong = [&](std::uint64_t pattern) { return (crc.Of(pattern >> 6U, 56) ^ none) != (pattern & 0x3FU); };
  for (unsigned a = 0; a < 62; ++a) {
    EXPECT_TRUE(wrong(std::uint64_t{1} << a)) << a;
    for (unsigned b = 0; b < a; ++b)
      EXPECT_TRUE(wrong(std::uint64_t{1} << a | std::uint64_t{1} << b)) << a << ' ' << b;
    for (std::uint64_t burst = 1; burst < 64 && a < 56; ++burst)
      EXPECT_TRUE(wrong(burst << a)) << a << ' ' << burst;
  }
}

}  // namespace
}  // namespace axlecast::biss
