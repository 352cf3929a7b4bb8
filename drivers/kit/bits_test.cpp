#include "drivers/kit/clocked_line.h"

#include <gtest/gtest.h>

#include <array>

namespace axlecast {
namespace {

constexpr std::array<std::uint8_t, 9> kBytes = {0x8A, 0xE3, 0x8A, 0x00, 0xFF, 0x5A, 0x81, 0x7E, 0xC1};
static_assert(BitsAt(kBytes, 0, 16) == 0x8AE3);
static_assert(BitsAt(kBytes, 4, 8) == 0xAE);
static_assert(BitsAt(kBytes, 71, 1) == 1);
static_assert(BitsAt(kBytes, 72, 0) == 0);

TEST(Bits, ManyAreAsEachAlone) {
  for (std::size_t first = 0; first <= 72; ++first) {
    for (std::size_t count = 0; count <= 64 && first + count <= 72; ++count) {
      std::uint64_t expected = 0;
      for (std::size_t i = 0; i < count; ++i) expected = expected * 2 + (BitAt(kBytes, first + i) ? 1 : 0);
      EXPECT_EQ(BitsAt(kBytes, first, count), expected) << first << ' ' << count;
    }
  }
}

}  // namespace
}  // namespace axlecast
