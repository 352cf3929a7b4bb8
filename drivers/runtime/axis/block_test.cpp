#include "drivers/runtime/axis/position_output.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

Interval At(MonoNs middle) { return {middle - 3'000, middle + 3'000}; }

TEST(Block, FortyReadingsFillIt) {
  Block block(131'072, 4, 5.0 / 131'072);
  EXPECT_TRUE(block.empty());
  for (int i = 0; i < 40; ++i) {
    const MonoNs at = kSecond + i * 51'000;
    ASSERT_FALSE(block.MustGoBefore(at, 2));
    ASSERT_FALSE(block.Full());
    block.Add(At(at), 100 + i, i, 2);
  }
  EXPECT_TRUE(block.Full());
  const position_block_t& message = block.Take();
  EXPECT_EQ(message.n, 40);
  EXPECT_EQ(message.mono_ns, kSecond);
  EXPECT_EQ(message.datum_epoch, 2);
  EXPECT_EQ(message.counts_per_turn, 131'072);
  EXPECT_EQ(message.dt_ns[0], 0);
  EXPECT_EQ(message.dt_ns[39], 39 * 51'000);
  EXPECT_EQ(message.counts[39], 139);
  EXPECT_EQ(message.flags[39], 39);
  EXPECT_EQ(message.time_uncertainty_ns[39], 3'000);
  EXPECT_LE(message.getEncodedSize(), 1'400);
}

TEST(Block, NeverSpansTwoEpochs) {
  Block block(131'072, 1, 1);
  block.Add(At(kSecond), 1, 1, 0);
  EXPECT_FALSE(block.MustGoBefore(kSecond + 1, 0));
  EXPECT_TRUE(block.MustGoBefore(kSecond + 1, 1));
}

TEST(Block, NeverSpansMoreThan100Milliseconds) {
  Block block(131'072, 1, 1);
  EXPECT_FALSE(block.Waited(kSecond));
  block.Add(At(kSecond), 1, 1, 0);
  EXPECT_FALSE(block.MustGoBefore(kSecond + 100 * kMillisecond, 0));
  EXPECT_TRUE(block.MustGoBefore(kSecond + 100 * kMillisecond + 1, 0));
  EXPECT_FALSE(block.Waited(kSecond + 99 * kMillisecond));
  EXPECT_TRUE(block.Waited(kSecond + 100 * kMillisecond));
}

TEST(Block, TimeAscends) {
  Block block(131'072, 1, 1);
  block.Add(At(kSecond), 1, 1, 0);
  EXPECT_TRUE(block.MustGoBefore(kSecond, 0));
  EXPECT_TRUE(block.MustGoBefore(kSecond - 5, 0));
}

TEST(Block, CountsWhatWasMissedUntilItIsSent) {
  Block block(131'072, 1, 1);
  block.Miss();
  block.Miss();
  block.Add(At(kSecond), 1, 1, 0);
  EXPECT_EQ(block.Take().missed, 2);
  block.Clear();
  EXPECT_TRUE(block.empty());
  EXPECT_EQ(block.Take().missed, 0);
}

}  // namespace
}  // namespace axlecast
