#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <utility>
#include <vector>

#include "tools/axlecast/decode/frame_text.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

using Vector = std::vector<std::uint8_t>;

TEST(HexLine, EveryWayToWriteTheSameFrame) {
  const Vector frame = {0x32, 0x00, 0x5F, 0x6D};
  for (const char* text :
       {"32 00 5F 6D", "32005F6D", "32005f6d", "0x32 0x00 0x5F 0x6d", "0X32,0x00,0x5F,0x6D", "0x32005F6D",
        "32:00:5f:6d", "32-00-5F-6D", "32, 00; 5F\t6D\r", "  3200 5f6d  # accepted", "32 00 5F 6D#x"}) {
    const auto line = ParseHexLine(text);
    ASSERT_TRUE(line) << text;
    EXPECT_EQ(*line, frame) << text;
  }
}

TEST(HexLine, NothingIsNoBytesAndNoProblem) {
  for (const char* text : {"", "   ", "\t\r", "# 1A 00", ",", "  # G"}) {
    ASSERT_TRUE(ParseHexLine(text)) << text;
    EXPECT_TRUE(ParseHexLine(text)->empty()) << text;
  }
}

TEST(HexLine, WhatIsNoHexIsRefusedWithItsColumn) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"1A G0", "column 4: 'G'"},  {"1A 0", "column 4: '0' is alone"}, {"1A0", "column 3: '0' is alone"},
      {"1", "column 1: '1'"},      {"0x", "column 3: the end"},        {"0x 1A", "column 3: ' '"},
      {"1A0x02", "column 3: '0'"}, {"1A 0G", "column 4: '0'"},         {"0x0x1A", "column 3: '0'"},
      {"x1A", "column 1: 'x'"},    {"1A\n02", "column 3: byte 0x0a"},  {"\xFF", "column 1: byte 0xff"},
      {"\"1A\"", "column 1: '\"'"}};
  for (const auto& [text, problem] : wrong) {
    const auto line = ParseHexLine(text);
    ASSERT_FALSE(line) << text;
    EXPECT_THAT(line.error().text, HasSubstr(problem)) << text;
  }
  EXPECT_THAT(ParseHexLine(std::string_view("1A\0", 3)).error().text, HasSubstr("byte 0x00"));
}

TEST(BitLine, EveryWayToWriteTheSameFrame) {
  for (const char* text : {"000111101111", "0001 1110 1111", "0001_1110_1111", "0b000111101111",
                           "0b0001,0b1110,0b1111", "0001-1110:1111\r", " 0001;1110\t1111 # SAA manual 5.5"}) {
    const auto line = ParseBitLine(text);
    ASSERT_TRUE(line) << text;
    EXPECT_EQ(line->bytes, (Vector{0x1E, 0xF0})) << text;
    EXPECT_EQ(line->bits, 12U) << text;
  }
}

TEST(BitLine, TheFirstBitIsTheMostSignificant) {
  EXPECT_EQ(ParseBitLine("1")->bytes, Vector{0x80});
  EXPECT_EQ(ParseBitLine("00000001")->bytes, Vector{0x01});
  EXPECT_EQ(ParseBitLine("000000011")->bytes, (Vector{0x01, 0x80}));
}

TEST(BitLine, NothingIsNoBitsAndNoProblem) {
  for (const char* text : {"", "  ", "\t\r", "# 101", "_"}) {
    ASSERT_TRUE(ParseBitLine(text)) << text;
    EXPECT_EQ(ParseBitLine(text)->bits, 0U) << text;
    EXPECT_TRUE(ParseBitLine(text)->bytes.empty()) << text;
  }
}

TEST(BitLine, WhatIsNoBitIsRefusedWithItsColumn) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"012", "column 3: '2'"},  {"1A", "column 2: 'A'"},   {"0b", "column 3: the end"},
      {"0b 1", "column 3: ' '"}, {"10b1", "column 3: 'b'"}, {"1\n0", "column 2: byte 0x0a"},
      {"0x10", "column 2: 'x'"}};
  for (const auto& [text, problem] : wrong) {
    const auto line = ParseBitLine(text);
    ASSERT_FALSE(line) << text;
    EXPECT_THAT(line.error().text, HasSubstr(problem)) << text;
  }
}

// The notations of cansend(1) and candump(1), can-utils 2020.11.
TEST(CanNotation, EveryWayToWriteTheSameFrame) {
  const Vector packet = {0x00, 0x00, 0x01, 0x20, 0x47, 0x26, 0x00};
  for (const char* text :
       {"120#472600", "120#47.26.00", "  120#472600  # at rest", "(1436509052.249713) can0 120#472600",
        "  can0  120   [3]  47 26 00", " (000.106400)  can0  120   [3]  47 26 00",
        "  can0  RX - -  120   [3]  47 26 00", "  can0  120   [3]  47 26 00   'G&.'"}) {
    const auto line = ParseCanNotation(text);
    ASSERT_TRUE(line && *line) << text;
    EXPECT_EQ(**line, packet) << text;
  }
}

TEST(CanNotation, KindsOfFrames) {
  const std::vector<std::pair<std::string, Vector>> frames = {
      {"7E5#", {0x00, 0x00, 0x07, 0xE5}},
      {"123#R", {0x40, 0x00, 0x01, 0x23}},
      {"123#R8", {0x40, 0x00, 0x01, 0x23}},
      {"can0  123   [0]  remote request", {0x40, 0x00, 0x01, 0x23}},
      {"00000123#11", {0x80, 0x00, 0x01, 0x23, 0x11}},
      {"1FFFFFFF#11", {0x9F, 0xFF, 0xFF, 0xFF, 0x11}},
      {"20000004#0001000000000000", {0x20, 0x00, 0x00, 0x04, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00}}};
  for (const auto& [text, packet] : frames) {
    const auto line = ParseCanNotation(text);
    ASSERT_TRUE(line && *line) << text;
    EXPECT_EQ(**line, packet) << text;
  }
}

TEST(CanNotation, WhatIsWrongIsNamedWithItsColumn) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"800#11", "column 1: an identifier"},
      {"12#11", "column 1: an identifier"},
      {"can0 G20#11", "column 6: an identifier"},
      {"120#4", "column 5: the data"},
      {"120#4G", "column 5: the data"},
      {"120#112233445566778899", "column 5: a frame has at most 8"},
      {"123##1aabb", "column 5: this is a CAN FD"},
      {"can0  120   [8]  47 26", "column 13: the frame has another"},
      {"can0  1200   [1]  47", "column 7: an identifier"}};
  for (const auto& [text, problem] : wrong) {
    const auto line = ParseCanNotation(text);
    ASSERT_TRUE(line && !*line) << text;
    EXPECT_THAT(line->error().text, HasSubstr(problem)) << text;
  }
}

TEST(CanNotation, HexOfAPacketIsLeftToTheReaderOfHex) {
  for (const char* text :
       {"", "00 00 01 20 47 26", "000001204726", "0x00000120 47 26", "00 00 01 20 # 120#47", "#"}) {
    EXPECT_FALSE(ParseCanNotation(text)) << text;
  }
}

}  // namespace

}  // namespace axlecast
