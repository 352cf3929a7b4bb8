#include "tools/fleet/column.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace axlecast {
namespace {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using Octets = std::vector<std::uint8_t>;
using Numbers = std::vector<std::int64_t>;

Octets Encode(const Numbers& values, ColumnId id = ColumnId::kCounts) {
  Octets bytes;
  AppendColumn(bytes, id, values);
  return bytes;
}

Result<Numbers> Decode(const Octets& column, std::size_t n) {
  Octets body;
  BeginBody(body, 1);
  body.insert(body.end(), column.begin(), column.end());
  const auto columns = SplitBody(body);
  if (!columns) return Failure(columns.error());
  return DecodeColumn(columns->at(0), n);
}

// Columns as the description of a chunk's body in docs/fleet.md has them, written by hand.

TEST(ColumnBytes, ARunOfEqualValuesIsADeltaOfNoWidth) {
  const Octets bytes{2, 1, 0, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 7};
  EXPECT_THAT(Encode({7, 7, 7, 7, 7}), ElementsAreArray(bytes));
  EXPECT_EQ(Decode(bytes, 5).value(), (Numbers{7, 7, 7, 7, 7}));
}

TEST(ColumnBytes, OneValue) {
  const Octets bytes{3, 1, 0, 0, 0, 0, 8, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFE};
  EXPECT_THAT(Encode({-2}, ColumnId::kFlags), ElementsAreArray(bytes));
  EXPECT_EQ(Decode(bytes, 1).value(), (Numbers{-2}));
}

// Residuals 1, -1, 2 in zigzag: 2, 1, 4.
TEST(ColumnBytes, DeltasOfOneByte) {
  const Octets bytes{2, 1, 1, 0, 0, 0, 11, 0, 0, 0, 0, 0, 0, 0, 100, 2, 1, 4};
  EXPECT_THAT(Encode({100, 101, 100, 102}), ElementsAreArray(bytes));
  EXPECT_EQ(Decode(bytes, 4).value(), (Numbers{100, 101, 100, 102}));
}

// 1000 x i: the first value and the difference, then residuals 0 and +3 (zigzag 6), -3 (5).
TEST(ColumnBytes, DeltasOfDeltas) {
  const Octets bytes{1, 2, 1, 0, 0, 0, 20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0xE8, 0, 0, 6, 11};
  EXPECT_EQ(Decode(bytes, 6).value(), (Numbers{0, 1000, 2000, 3000, 4003, 5000}));
}

// From 0 to 10 in 4 steps: 0, 2 (2.5), 5, 7 (7.5), 10; downward 0, -2, -5, -7, -10.
TEST(ColumnBytes, ALineIsRoundedTowardItsBegin) {
  const Octets up{2, 0, 0, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 10};
  EXPECT_EQ(Decode(up, 5).value(), (Numbers{0, 2, 5, 7, 10}));
  Octets down = up;
  std::fill(down.end() - 8, down.end() - 1, std::uint8_t{0xFF});
  down.back() = 0xF6;
  EXPECT_EQ(Decode(down, 5).value(), (Numbers{0, -2, -5, -7, -10}));
  // 5 values with residuals 0, 1, 0, -1, 0.
  const Octets bent{2, 0, 1, 0, 0, 0, 21, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 10, 0, 2, 0, 1, 0};
  EXPECT_EQ(Decode(bent, 5).value(), (Numbers{0, 3, 5, 6, 10}));
}

// Zigzag 254 is a byte; 255 is an escape and follows in 8 bytes.
TEST(ColumnBytes, Escapes) {
  const Octets byte{2, 1, 1, 0, 0, 0, 18, 0, 0, 0, 0, 0, 0, 0, 0, 0xFE, 0xFF, 0, 0, 0, 0, 0, 0, 0, 0xFF};
  EXPECT_EQ(Decode(byte, 3).value(), (Numbers{0, 127, -1}));
  const Octets word{2, 1, 2, 0, 0, 0, 20, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFE, 0xFF, 0xFF, 0, 0, 0, 0, 0, 1, 0, 0};
  EXPECT_EQ(Decode(word, 3).value(), (Numbers{0, 32767, 32767 + 32768}));
}

TEST(ColumnBytes, WidthsOfFourAndEightBytesHaveNoEscape) {
  const Octets four{2, 1, 4, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF};
  EXPECT_EQ(Decode(four, 2).value(), (Numbers{0, -2147483648LL}));
  const Octets eight{2, 1, 8, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
  EXPECT_EQ(Decode(eight, 2).value(), (Numbers{0, INT64_MIN}));
}

TEST(ColumnBytes, Runs) {
  Octets bytes{3, 3, 0, 0, 0, 0, 20, 0, 100, 0, 0, 0, 0, 0, 0, 0, 3, 0, 156, 0, 0, 0, 0, 0, 1, 0, 0};
  Numbers values(100, 3);
  values.resize(256, 65536);
  EXPECT_THAT(Encode(values, ColumnId::kFlags), ElementsAreArray(bytes));
  EXPECT_EQ(Decode(bytes, 256).value(), values);
}

TEST(Column, EveryPatternReturnsExactly) {
  std::mt19937_64 random(1);
  const std::vector<std::int64_t> extremes{INT64_MIN, INT64_MIN + 1, -1, 0, 1, INT64_MAX - 1, INT64_MAX};
  for (int round = 0; round < 20'000; ++round) {
    const std::size_t n = 1 + random() % (round % 2 == 0 ? 5 : kMaxChunkSamples);
    const std::uint64_t kind = random() % 6;
    const std::uint64_t bits = random() % 64;
    Numbers values;
    std::uint64_t at = random();
    const std::uint64_t step = random() >> bits;
    for (std::size_t i = 0; i < n; ++i) {
      switch (kind) {
        case 0:
          at = random();
          break;
        case 1:
          at += random() >> bits;
          break;
        case 2:
          at += step + random() % 100;
          break;
        case 3:
          at = random() % 50 == 0 ? random() : at;
          break;
        case 4:
          at = static_cast<std::uint64_t>(extremes[random() % extremes.size()]);
          break;
        default:
          at = step * i + (random() % 30 == 0 ? random() : 0);
      }
      values.push_back(static_cast<std::int64_t>(at));
    }
    const Octets bytes = Encode(values);
    ASSERT_LE(bytes.size(), 7 + 8 + 8 * n);
    ASSERT_EQ(Decode(bytes, n).value(), values);
  }
}

// 250 Hz with a jitter of 100 us: the sums of differences would drift, but a line needs a byte a sample.
TEST(Column, TakesTheSmallestForm) {
  std::mt19937_64 random(2);
  Numbers jitter;
  Numbers walk;
  for (std::int64_t i = 0; i < 256; ++i) {
    jitter.push_back(4'000 * i + static_cast<std::int64_t>(random() % 100));
    walk.push_back((i > 0 ? walk.back() : 0) + static_cast<std::int64_t>(random() % 200) - 100);
  }
  EXPECT_EQ(Encode(jitter).size(), 7 + 16 + 256U);
  EXPECT_EQ(Encode(jitter)[1], static_cast<std::uint8_t>(ColumnMode::kLinear));
  EXPECT_EQ(Encode(walk).size(), 7 + 8 + 255U);
}

TEST(Column, RefusesWhatHasAnotherNumberOfValues) {
  const Numbers values{1, 5, 3, 900, -4, 70'000};
  const Octets bytes = Encode(values);
  EXPECT_TRUE(Decode(bytes, 6));
  for (const std::size_t n : {0U, 1U, 5U, 7U, 257U}) EXPECT_FALSE(Decode(bytes, n)) << n;
  const Octets runs = Encode(Numbers(10, 4), ColumnId::kFlags);
  EXPECT_THAT(ErrorText(Decode({3, 3, 0, 0, 0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 1)),
              HasSubstr("wrong length"));
  EXPECT_THAT(ErrorText(Decode({3, 3, 0, 0, 0, 0, 10, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0}, 1)),
              HasSubstr("wrong length"));
  EXPECT_TRUE(Decode(runs, 10));
}

TEST(Column, RefusesUnknownFormsAndSteepLines) {
  Octets line{2, 0, 0, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x10, 0, 0, 0, 0, 0, 0};
  EXPECT_THAT(ErrorText(Decode(line, 2)), HasSubstr("too steep"));  // 2^52
  line[16] = 0x0F;
  EXPECT_TRUE(Decode(line, 2));
  EXPECT_FALSE(Decode(line, 1));
  line[1] = 4;
  EXPECT_THAT(ErrorText(Decode(line, 2)), HasSubstr("unknown mode"));
  line[1] = 1;
  line[2] = 3;
  EXPECT_THAT(ErrorText(Decode(line, 2)), HasSubstr("unknown width"));
}

TEST(Body, RefusesWhatIsDamaged) {
  Octets body;
  BeginBody(body, 2);
  AppendColumn(body, ColumnId::kTime, Numbers{0, 4000, 8000});
  AppendColumn(body, ColumnId::kCounts, Numbers{1, 2, 4});
  ASSERT_EQ(SplitBody(body).value().size(), 2U);
  for (std::size_t size = 0; size < body.size(); ++size) EXPECT_FALSE(SplitBody(Bytes(body).first(size))) << size;
  Octets longer = body;
  longer.push_back(0);
  EXPECT_THAT(ErrorText(SplitBody(longer)), HasSubstr("bytes behind"));
  Octets newer = body;
  newer[0] = 2;
  EXPECT_THAT(ErrorText(SplitBody(newer)), HasSubstr("use a newer axlecast"));
  Octets twice;
  BeginBody(twice, 2);
  AppendColumn(twice, ColumnId::kTime, Numbers{0});
  AppendColumn(twice, ColumnId::kTime, Numbers{0});
  EXPECT_THAT(ErrorText(SplitBody(twice)), HasSubstr("twice"));
}

}  // namespace
}  // namespace axlecast
