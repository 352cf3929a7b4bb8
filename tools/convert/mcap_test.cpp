#include "tools/convert/conversion.h"

#include <gtest/gtest.h>

#include "core/messages/json/field.h"
#include "tools/convert/test_events.h"

namespace axlecast {
namespace {

std::string Hex(std::string_view text) { return HexDigits(AsBytes(text)); }

// Byte by byte from https://mcap.dev/spec; whole files are read by MCAP's own library in tests/convert.
TEST(McapWriter, AFileWithoutMessages) {
  TestOutput output;
  static_cast<void>(WriteMcap(TestEvents().range(), output.sink()));
  const std::string hex = Hex(output.text);
  EXPECT_EQ(hex.substr(0, 66),
            "894d434150300d0a"  // magic
            "01"
            "1000000000000000"  // header: 16 bytes
            "00000000"
            "08000000"
            "61786c6563617374");                        // no profile, library "axlecast"
  EXPECT_EQ(hex.substr(66, 18), "0f0400000000000000");  // the end of the data: 4 bytes, their CRC
  EXPECT_EQ(hex.substr(92, 18), "0b2e00000000000000");  // statistics: 46 bytes
  EXPECT_EQ(hex.substr(hex.size() - 16), "894d434150300d0a");
  const std::string footer = hex.substr(hex.size() - 16 - 58, 58);
  EXPECT_EQ(footer.substr(0, 18), "021400000000000000");
  EXPECT_EQ(footer.substr(18, 16), "2e00000000000000");  // the summary begins at byte 46
}

TEST(McapWriter, StopsWhereTheOutputDoes) {
  TestOutput output;
  output.room = 2;
  TestEvents events;
  for (int i = 0; i < 3; ++i) events.AddRaw(i, "topic", std::vector<std::uint8_t>(1U << 20, 'x'));
  EXPECT_EQ(WriteMcap(events.range(), output.sink()).written, 1);
}

}  // namespace
}  // namespace axlecast
