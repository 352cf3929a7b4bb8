#include "tools/axlecast/decode/can_notation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace axlecast {
namespace {

using testing::HasSubstr;
using Vector = std::vector<std::uint8_t>;

// The notations of cansend(1) and candump(1), can-utils 2020.11.
TEST(CanNotation, EveryWayToWriteTheSameFrame) {
  const Vector packet = {0x00, 0x00, 0x01, 0x20, 0x47, 0x26, 0x00};
  for (const char* text :
       {"120#472600", "120#47.26.00", "  120#472600  # at rest", "(1436509052.249713) can0 120#472600",
        "  can0  120   [3]  47 26 00", " (000.106400)  can0  120   [3]  47 26 00",
        "  can0  RX - -  120   [3]  47 26 00", "  can0  120   [3]  47 26 00   'G&.'"}) {
    const std::optional<HexLine> line = ParseCanNotation(text);
    ASSERT_TRUE(line) << text;
    EXPECT_EQ(line->problem, "") << text;
    EXPECT_EQ(line->bytes, packet) << text;
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
    const std::optional<HexLine> line = ParseCanNotation(text);
    ASSERT_TRUE(line) << text;
    EXPECT_EQ(line->problem, "") << text;
    EXPECT_EQ(line->bytes, packet) << text;
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
    const std::optional<HexLine> line = ParseCanNotation(text);
    ASSERT_TRUE(line) << text;
    EXPECT_THAT(line->problem, HasSubstr(problem)) << text;
    EXPECT_TRUE(line->bytes.empty()) << text;
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
