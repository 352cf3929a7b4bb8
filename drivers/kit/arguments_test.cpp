#include "drivers/kit/arguments.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(ParseWhole, TakesDecimalAndHexWithinItsRange) {
  EXPECT_EQ(ParseWhole("79", 0, 79), 79);
  EXPECT_EQ(ParseWhole("0x4F", 0, 79), 79);
  EXPECT_EQ(ParseWhole("-3", -5, 5), -3);
  for (const char* text : {"80", "-1", "", "0x", "7 ", " 7", "7a", "1e1", "99999999999999999999"}) {
    EXPECT_FALSE(ParseWhole(text, 0, 79)) << text;
  }
}

TEST(ParseCommandLine, TakesAnOperationWithItsArguments) {
  const CommandLine line = ParseCommandLine("eeprom_write address=72 data=A1 05");
  EXPECT_EQ(line.operation, "eeprom_write");
  EXPECT_EQ(FindArgument(line.arguments, "address"), "72");
  EXPECT_EQ(FindArgument(line.arguments, "data"), "A1 05");
  EXPECT_FALSE(FindArgument(line.arguments, "bytes"));
  EXPECT_EQ(ParseCommandLine("").operation, "");
}

TEST(ParseHex, TakesBytesWithOrWithoutBlanks) {
  EXPECT_EQ(ParseHex("A1 05"), (std::vector<std::uint8_t>{0xA1, 5}));
  EXPECT_EQ(ParseHex("a105"), (std::vector<std::uint8_t>{0xA1, 5}));
  for (const char* text : {"", " ", "A", "A1 0", "G1", "A1,05"}) EXPECT_FALSE(ParseHex(text)) << text;
}

}  // namespace
}  // namespace axlecast
