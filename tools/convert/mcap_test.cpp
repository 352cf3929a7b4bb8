#include "tools/convert/mcap.h"

#include <gtest/gtest.h>

#include "core/messages/json/field.h"
#include "tools/convert/test_events.h"

namespace axlecast {
namespace {

std::string Hex(std::string_view text) {
  return HexDigits(Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

// Byte by byte from https://mcap.dev/spec; whole files are read by MCAP's own library in tests/convert.
TEST(McapWriter, AFileWithoutMessages) {
  TestOutput output;
  McapWriter writer(output.sink());
  writer.Finish();
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
  McapWriter writer(output.sink());
  EXPECT_TRUE(writer.good());
  const std::uint16_t channel = writer.AddChannel(0, "topic", "lcm");
  const std::string large(McapWriter::kChunkBytes, 'x');
  writer.Write(McapWriter::Message{.channel = channel, .data = large});
  EXPECT_FALSE(writer.good());
}

}  // namespace
}  // namespace axlecast
