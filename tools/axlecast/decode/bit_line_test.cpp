#include "tools/axlecast/decode/bit_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using testing::HasSubstr;
using Vector = std::vector<std::uint8_t>;

TEST(BitLine, EveryWayToWriteTheSameFrame) {
  for (const char* text : {"000111101111", "0001 1110 1111", "0001_1110_1111", "0b000111101111",
                           "0b0001,0b1110,0b1111", "0001-1110:1111\r", " 0001;1110\t1111 # SAA manual 5.5"}) {
    const BitLine line = ParseBitLine(text);
    EXPECT_EQ(line.bytes, (Vector{0x1E, 0xF0})) << text;
    EXPECT_EQ(line.bits, 12U) << text;
    EXPECT_EQ(line.problem, "") << text;
  }
}

TEST(BitLine, TheFirstBitIsTheMostSignificant) {
  EXPECT_EQ(ParseBitLine("1").bytes, Vector{0x80});
  EXPECT_EQ(ParseBitLine("00000001").bytes, Vector{0x01});
  EXPECT_EQ(ParseBitLine("000000011").bytes, (Vector{0x01, 0x80}));
}

TEST(BitLine, NothingIsNoBitsAndNoProblem) {
  for (const char* text : {"", "  ", "\t\r", "# 101", "_"}) {
    EXPECT_EQ(ParseBitLine(text).bits, 0U) << text;
    EXPECT_TRUE(ParseBitLine(text).bytes.empty()) << text;
    EXPECT_EQ(ParseBitLine(text).problem, "") << text;
  }
}

TEST(BitLine, WhatIsNoBitIsRefusedWithItsColumn) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"012", "column 3: '2'"},  {"1A", "column 2: 'A'"},   {"0b", "column 3: the end"},
      {"0b 1", "column 3: ' '"}, {"10b1", "column 3: 'b'"}, {"1\n0", "column 2: byte 0x0a"},
      {"0x10", "column 2: 'x'"}};
  for (const auto& [text, problem] : wrong) {
    const BitLine line = ParseBitLine(text);
    EXPECT_TRUE(line.bytes.empty()) << text;
    EXPECT_EQ(line.bits, 0U) << text;
    EXPECT_THAT(line.problem, HasSubstr(problem)) << text;
  }
}

}  // namespace
}  // namespace axlecast
