#include "tools/fleet/ship/expiry_schedule.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/fake_clock.h"

namespace axlecast {
namespace {

// Seconds from the start until it is due for the first time.
MonoNs FirstOf(std::uint64_t seed) {
  FakeClock clock;
  const MonoNs start = clock.Now();
  ExpirySchedule schedule;
  while (!schedule.IsDue(clock.Now(), seed)) clock.Advance(kSecond);
  return (clock.Now() - start) / kSecond;
}

TEST(ExpirySchedule, BeginsSomeMinutesAfterTheStartAndNotForAllAtOnce) {
  std::set<MonoNs> times;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const MonoNs first = FirstOf(seed);
    EXPECT_GE(first, 120);
    EXPECT_LE(first, 420);
    times.insert(first);
  }
  EXPECT_GT(times.size(), 60U);
  EXPECT_LT(*times.begin(), 150);
  EXPECT_GT(*times.rbegin(), 390);
}

TEST(ExpirySchedule, RepeatsOnceAnHour) {
  FakeClock clock;
  ExpirySchedule schedule;
  int due = 0;
  for (int second = 0; second < 5 * 3600; ++second) {
    due += schedule.IsDue(clock.Now(), 7) ? 1 : 0;
    clock.Advance(kSecond);
  }
  EXPECT_EQ(due, 5);
  EXPECT_FALSE(schedule.IsDue(clock.Now(), 7));
  clock.Advance(30 * 24 * 3600 * kSecond);  // the computer has slept: once, not for each hour
  EXPECT_TRUE(schedule.IsDue(clock.Now(), 7));
  EXPECT_FALSE(schedule.IsDue(clock.Now(), 7));
}

}  // namespace
}  // namespace axlecast
