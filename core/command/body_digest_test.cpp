#include "core/command/body_digest.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

// Values of Python's hashlib.blake2b(message, digest_size=32) (RFC 7693).
TEST(BodyDigest, IsTheBeginningOfBlake2b256) {
  EXPECT_EQ(static_cast<std::uint64_t>(BodyDigest({})), 0x0e5751c026e543b2u);
  const std::array<std::uint8_t, 3> abc = {'a', 'b', 'c'};
  EXPECT_EQ(static_cast<std::uint64_t>(BodyDigest(abc)), 0xbddd813c63423972u);
}

}  // namespace
}  // namespace axlecast
