#include "drivers/tformat/reset_counter.h"

#include <gtest/gtest.h>

namespace axlecast::tformat {
namespace {

constexpr MonoNs kApart = 40 * kMillisecond;

// True when the last of `times` requests, each `apart`, completes.
bool Repeat(ResetCounter& counter, std::uint8_t id, int times, MonoNs apart, MonoNs& now) {
  bool complete = false;
  for (int i = 0; i < times; ++i) {
    now += apart;
    complete = counter.OnReset(id, now);
  }
  return complete;
}

TEST(ResetCounterTest, TenRequestsFortyMillisecondsApart) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0x7, 9, kApart, now));
  EXPECT_TRUE(Repeat(counter, 0x7, 1, kApart, now));
  EXPECT_EQ(counter.broken(), 0);
}

TEST(ResetCounterTest, AfterTheTenthTheCountBeginsAnew) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_TRUE(Repeat(counter, 0x7, 10, kApart, now));
  EXPECT_FALSE(Repeat(counter, 0x7, 9, kApart, now));
  EXPECT_TRUE(Repeat(counter, 0x7, 1, kApart, now));
}

TEST(ResetCounterTest, ThirtyNineMillisecondsDoNotCount) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0xC, 100, 39 * kMillisecond, now));
  EXPECT_GT(counter.too_early(), 0);
  EXPECT_LE(counter.count(), 1);
}

TEST(ResetCounterTest, OneEarlyRequestEndsTheSequence) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0x7, 8, kApart, now));
  EXPECT_FALSE(Repeat(counter, 0x7, 1, kApart - 1, now));
  EXPECT_EQ(counter.count(), 0);
  EXPECT_FALSE(Repeat(counter, 0x7, 9, kApart, now));
  EXPECT_TRUE(Repeat(counter, 0x7, 1, kApart, now));
}

TEST(ResetCounterTest, AnotherResetEndsTheSequence) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0x7, 9, kApart, now));
  EXPECT_FALSE(Repeat(counter, 0xC, 1, kApart, now));
  EXPECT_FALSE(Repeat(counter, 0x7, 1, kApart, now));
  EXPECT_EQ(counter.broken(), 2);
}

TEST(ResetCounterTest, AReadoutEndsTheSequence) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0x8, 9, kApart, now));
  counter.Break();
  EXPECT_FALSE(Repeat(counter, 0x8, 9, kApart, now));
  EXPECT_TRUE(Repeat(counter, 0x8, 1, kApart, now));
  EXPECT_EQ(counter.broken(), 1);
}

}  // namespace
}  // namespace axlecast::tformat
