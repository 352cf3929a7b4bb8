#include "tools/axlecast/decode/hex_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using testing::HasSubstr;
using Vector = std::vector<std::uint8_t>;

TEST(HexLine, EveryWayToWriteTheSameFrame) {
  const Vector frame = {0x32, 0x00, 0x5F, 0x6D};
  for (const char* text :
       {"32 00 5F 6D", "32005F6D", "32005f6d", "0x32 0x00 0x5F 0x6d", "0X32,0x00,0x5F,0x6D", "0x32005F6D",
        "32:00:5f:6d", "32-00-5F-6D", "32, 00; 5F\t6D\r", "  3200 5f6d  # accepted", "32 00 5F 6D#x"}) {
    const HexLine line = ParseHexLine(text);
    EXPECT_EQ(line.bytes, frame) << text;
    EXPECT_EQ(line.problem, "") << text;
  }
}

TEST(HexLine, NothingIsNoBytesAndNoProblem) {
  for (const char* text : {"", "   ", "\t\r", "# 1A 00", ",", "  # G"}) {
    EXPECT_TRUE(ParseHexLine(text).bytes.empty()) << text;
    EXPECT_EQ(ParseHexLine(text).problem, "") << text;
  }
}

TEST(HexLine, WhatIsNoHexIsRefusedWithItsColumn) {
  const std::vector<std::pair<std::string, std::string>> wrong = {{"1A G0", "column 4: 'G'"},
                                                                  {"1A 0", "column 4: '0' stands alone"},
                                                                  {"1A0", "column 3: '0' stands alone"},
                                                                  {"1", "column 1: '1'"},
                                                                  {"0x", "column 3: the end"},
                                                                  {"0x 1A", "column 3: ' '"},
                                                                  {"1A0x02", "column 3: '0'"},
                                                                  {"1A 0G", "column 4: '0'"},
                                                                  {"0x0x1A", "column 3: '0'"},
                                                                  {"x1A", "column 1: 'x'"},
                                                                  {"1A\n02", "column 3: byte 0x0a"},
                                                                  {"\xFF", "column 1: byte 0xff"},
                                                                  {"\"1A\"", "column 1: '\"'"}};
  for (const auto& [text, problem] : wrong) {
    const HexLine line = ParseHexLine(text);
    EXPECT_TRUE(line.bytes.empty()) << text;
    EXPECT_THAT(line.problem, HasSubstr(problem)) << text;
  }
  EXPECT_THAT(ParseHexLine(std::string_view("1A\0", 3)).problem, HasSubstr("byte 0x00"));
}

}  // namespace
}  // namespace axlecast
