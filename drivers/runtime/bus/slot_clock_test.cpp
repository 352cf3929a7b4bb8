#include "drivers/runtime/bus/schedule.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

constexpr MonoNs kPeriod = 51 * kMicrosecond;

TEST(SlotClockTest, SlotsAreAbsoluteMultiplesOfThePeriodPlusThePhase) {
  SlotClock slots(kPeriod, 7'000);
  slots.Start(1'000 * kSecond);
  EXPECT_GE(slots.next(), 1'000 * kSecond);
  EXPECT_LT(slots.next(), 1'000 * kSecond + kPeriod);
  EXPECT_EQ((slots.next() - 7'000) % kPeriod, 0);
  for (int i = 0; i < 1'000; ++i) {
    const MonoNs due = slots.next();
    slots.Take(due + i * 50);  // a start that is late by less than a period shifts nothing
    EXPECT_EQ(slots.next(), due + kPeriod);
  }
  EXPECT_EQ(slots.late(), 0);
}

TEST(SlotClockTest, TwoBusesWithOnePhaseSampleAtTheSameInstants) {
  SlotClock first(kMillisecond, 250 * kMicrosecond);
  SlotClock second(kMillisecond, 250 * kMicrosecond);
  first.Start(5 * kSecond + 1);
  second.Start(5 * kSecond + 249 * kMicrosecond);
  EXPECT_EQ(first.next(), 5 * kSecond + 250 * kMicrosecond);
  EXPECT_EQ(second.next(), first.next());
}

TEST(SlotClockTest, StartsWithTheSlotOfThisInstant) {
  SlotClock slots(kMillisecond, 0);
  slots.Start(3 * kMillisecond);
  EXPECT_TRUE(slots.Due(3 * kMillisecond));
  slots.Start(3 * kMillisecond + 1);
  EXPECT_EQ(slots.next(), 4 * kMillisecond);
  SlotClock before_phase(kMillisecond, 10 * kMillisecond + 5);
  before_phase.Start(2 * kMillisecond);
  EXPECT_EQ(before_phase.next(), 2 * kMillisecond + 5);
}

TEST(SlotClockTest, CountsMissedSlotsAndSkipsThem) {
  SlotClock slots(kPeriod, 0);
  slots.Start(0);
  slots.Take(0);
  slots.Take(5 * kPeriod + 10);  // slots 1 to 4 were missed, 5 is used
  EXPECT_EQ(slots.late(), 4);
  EXPECT_FALSE(slots.Due(6 * kPeriod - 1));
  EXPECT_TRUE(slots.Due(6 * kPeriod));
}

TEST(SlotClockTest, SlotsThatNobodyWantsAreNotLate) {
  SlotClock slots(kPeriod, 0);
  slots.Start(0);
  slots.Excuse(3 * kPeriod);
  slots.Take(5 * kPeriod);  // 0, 1, 2 unwanted; 3 and 4 missed
  EXPECT_EQ(slots.late(), 2);
  slots.Excuse(kNever);
  slots.Take(50 * kPeriod);
  EXPECT_EQ(slots.late(), 2);
  slots.Take(52 * kPeriod);  // the excuse went with the slot that was taken
  EXPECT_EQ(slots.late(), 3);
}

TEST(SlotClockTest, WithoutPeriodAlwaysDueAndNeverLate) {
  SlotClock slots(0, 0);
  slots.Start(kSecond);
  for (MonoNs now = kSecond; now < kSecond + 1'000; now += 100) {
    EXPECT_TRUE(slots.Due(now));
    slots.Take(now);
  }
  EXPECT_EQ(slots.late(), 0);
}

}  // namespace
}  // namespace axlecast
