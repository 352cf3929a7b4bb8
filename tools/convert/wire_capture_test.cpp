#include "tools/convert/conversion.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

// The form of can-utils' own files (man candump, -L): "(1436509052.249713) vcan0 044#2A366C2BBA".
TEST(CandumpLine, AsCanUtilsWriteIt) {
  const std::int64_t ns = 1'436'509'052'249'713'999;
  EXPECT_EQ(CandumpLine(ns, "vcan0", {.id = 0x44, .data = {0x2A, 0x36, 0x6C, 0x2B, 0xBA}}),
            "(1436509052.249713) vcan0 044#2A366C2BBA\n");
  EXPECT_EQ(CandumpLine(ns, "vcan0", {.id = 0x44 | kCanExtended, .data = {}}),
            "(1436509052.249713) vcan0 00000044#\n");
  EXPECT_EQ(CandumpLine(0, "can0", {.id = 0x701 | kCanRemote, .data = {}}), "(0000000000.000000) can0 701#R\n");
  EXPECT_EQ(CandumpLine(0, "can0", {.id = 4 | kCanError, .data = {0, 1}}),
            "(0000000000.000000) can0 20000004#0001\n");
}

TEST(CandumpLine, NamesThatLinuxCannotHave) {
  EXPECT_EQ(CandumpLine(0, "a bus with a long name", {.id = 1, .data = {}}),
            "(0000000000.000000) a_bus_with_a_lo 001#\n");
  EXPECT_EQ(CandumpLine(0, "", {.id = 1, .data = {}}), "(0000000000.000000) can 001#\n");
}

}  // namespace
}  // namespace axlecast
