#include "core/command/commands.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

// Values of Python's hashlib.blake2b(message, digest_size=32) (RFC 7693).
TEST(BodyDigest, IsTheBeginningOfBlake2b256) {
  EXPECT_EQ(static_cast<std::uint64_t>(BodyDigest({})), 0x0e5751c026e543b2u);
  const std::array<std::uint8_t, 3> abc = {'a', 'b', 'c'};
  EXPECT_EQ(static_cast<std::uint64_t>(BodyDigest(abc)), 0xbddd813c63423972u);
}

TEST(CommandWords, IdsAreThirtyTwoHexDigits) {
  const auto id = ParseId("00112233445566778899AAbbccddeeff");
  ASSERT_TRUE(id);
  EXPECT_EQ(IdText(*id), "00112233445566778899aabbccddeeff");
  EXPECT_FALSE(ParseId("00112233445566778899aabbccddeef"));
  EXPECT_FALSE(ParseId("00112233445566778899aabbccddeefg"));
}

}  // namespace

}  // namespace axlecast
