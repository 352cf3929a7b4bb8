#include "platform/os/system_clock.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace axlecast {
namespace {

TEST(WaitUntil, IsNeverEarly) {
  const SystemClock clock;
  for (const MonoNs wait : {MonoNs{0}, 10 * kMicrosecond, 300 * kMicrosecond, 2 * kMillisecond}) {
    const MonoNs instant = clock.Now() + wait;
    WaitUntil(instant, clock);
    EXPECT_GE(clock.Now(), instant);
  }
  const MonoNs before = clock.Now();
  WaitUntil(before - kSecond, clock);
  EXPECT_LT(clock.Now(), before + kSecond) << "what has passed is not waited for";
}

// A short wait does not take a timer's slack on top. The best of many: others run on this machine too.
TEST(WaitUntil, IsSharpWhereItIsShort) {
  const SystemClock clock;
  MonoNs latest = kNever;
  for (int i = 0; i < 100; ++i) {
    const MonoNs instant = clock.Now() + 10 * kMicrosecond;
    WaitUntil(instant, clock);
    latest = std::min(latest, clock.Now() - instant);
  }
  EXPECT_LT(latest, 10 * kMicrosecond);
}

TEST(PollUntil, EndsAtItsDeadlineWithoutFiles) {
  const SystemClock clock;
  const MonoNs deadline = clock.Now() + kMillisecond;
  EXPECT_EQ(PollUntil({}, deadline, clock), 0);
  EXPECT_GE(clock.Now(), deadline);
}

}  // namespace

}  // namespace axlecast
