#include "drivers/runtime/bus/slot_clock.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>

namespace axlecast {
namespace {

constexpr MonoNs kPeriod = 51 * kMicrosecond;

TEST(SlotClockTest, SlotsAreAbsoluteMultiplesOfThePeriodPlusThePhase) {
  SlotClock slots({.period = kPeriod, .phase = 7'000});
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
  SlotClock first({.period = kMillisecond, .phase = 250 * kMicrosecond});
  SlotClock second({.period = kMillisecond, .phase = 250 * kMicrosecond});
  first.Start(5 * kSecond + 1);
  second.Start(5 * kSecond + 249 * kMicrosecond);
  EXPECT_EQ(first.next(), 5 * kSecond + 250 * kMicrosecond);
  EXPECT_EQ(second.next(), first.next());
}

TEST(SlotClockTest, StartsWithTheSlotOfThisInstant) {
  SlotClock slots({.period = kMillisecond, .phase = 0});
  slots.Start(3 * kMillisecond);
  EXPECT_TRUE(slots.Due(3 * kMillisecond));
  slots.Start(3 * kMillisecond + 1);
  EXPECT_EQ(slots.next(), 4 * kMillisecond);
  SlotClock before_phase({.period = kMillisecond, .phase = 10 * kMillisecond + 5});
  before_phase.Start(2 * kMillisecond);
  EXPECT_EQ(before_phase.next(), 2 * kMillisecond + 5);
}

TEST(SlotClockTest, CountsMissedSlotsAndSkipsThem) {
  SlotClock slots({.period = kPeriod, .phase = 0});
  slots.Start(0);
  slots.Take(0);
  slots.Take(5 * kPeriod + 10);  // slots 1 to 4 were missed, 5 is used
  EXPECT_EQ(slots.late(), 4);
  EXPECT_FALSE(slots.Due(6 * kPeriod - 1));
  EXPECT_TRUE(slots.Due(6 * kPeriod));
}

TEST(SlotClockTest, SlotsThatNobodyWantsAreNotLate) {
  SlotClock slots({.period = kPeriod, .phase = 0});
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
  SlotClock slots({.period = 0, .phase = 0});
  slots.Start(kSecond);
  for (MonoNs now = kSecond; now < kSecond + 1'000; now += 100) {
    EXPECT_TRUE(slots.Due(now));
    slots.Take(now);
  }
  EXPECT_EQ(slots.late(), 0);
}

// A base that is `ahead` of CLOCK_MONOTONIC.
class FakeBase final : public BaseClaims {
 public:
  [[nodiscard]] std::optional<BaseClaim> At(MonoNs mono) const override {
    if (!known) return std::nullopt;
    return BaseClaim{.base_id = 1, .base_ns = mono + ahead, .half_width_ns = half_width};
  }

  bool known = true;
  MonoNs ahead = 0;
  MonoNs half_width = 0;
};

TEST(SlotClockTest, SlotsHaveTheNumbersOfTheirTicks) {
  SlotClock slots({.period = kMillisecond, .phase = 100 * kMicrosecond});
  slots.Start(5 * kMillisecond);
  EXPECT_EQ(slots.next(), 5 * kMillisecond + 100 * kMicrosecond);
  EXPECT_EQ(slots.Take(slots.next() + 900), 5);
  EXPECT_EQ(slots.Take(slots.next()), 6);
  EXPECT_EQ(slots.Take(slots.next() + 3 * kMillisecond), 10) << "7, 8 and 9 were missed";
  SlotClock unpaced({});
  unpaced.Start(0);
  EXPECT_EQ(unpaced.Take(kSecond), kNoTick);
}

TEST(SlotClockTest, ASlotBeginsBeforeItsTickByTheLead) {
  SlotClock slots({.period = kMillisecond, .phase = 0, .lead = 5 * kMicrosecond});
  slots.Start(3 * kMillisecond - 5 * kMicrosecond);
  EXPECT_EQ(slots.next(), 3 * kMillisecond - 5 * kMicrosecond);
  EXPECT_EQ(slots.Take(slots.next()), 3);
  EXPECT_EQ(slots.next(), 4 * kMillisecond - 5 * kMicrosecond);
}

TEST(SlotClockTest, BusesOfTwoHostsHaveTheSameTicksOfTheBase) {
  FakeBase here;
  here.ahead = 7 * kSecond + 300 * kMicrosecond;
  FakeBase there;
  there.ahead = 90 * kSecond - 1;
  SlotClock first({.period = kMillisecond}, &here);
  SlotClock second({.period = kMillisecond}, &there);
  first.Start(100 * kSecond - here.ahead);
  second.Start(100 * kSecond - there.ahead);
  for (std::int64_t tick = 100'000; tick < 100'100; ++tick) {
    EXPECT_EQ(first.next() + here.ahead, second.next() + there.ahead);
    EXPECT_EQ(first.Take(first.next()), tick);
    EXPECT_EQ(second.Take(second.next()), tick);
  }
}

TEST(SlotClockTest, WithoutAClaimTheSlotsKeepTheirPaceAndHaveNoNumbers) {
  FakeBase base;
  base.known = false;
  SlotClock slots({.period = kMillisecond}, &base);
  slots.Start(10 * kMillisecond);
  EXPECT_EQ(slots.Take(10 * kMillisecond), kNoTick);
  EXPECT_EQ(slots.next(), 11 * kMillisecond);
}

// From the first claim on, and after every step of the base.
TEST(SlotClockTest, SlotsMoveTowardsTheTicksByOnePercentOfThePeriod) {
  FakeBase base;
  base.known = false;
  SlotClock slots({.period = kMillisecond}, &base);
  slots.Start(10 * kMillisecond);
  for (const MonoNs ahead : {3 * kSecond + 400 * kMicrosecond, 5 * kSecond + 900 * kMicrosecond, kSecond}) {
    base.known = true;
    base.ahead = ahead;
    const std::int64_t late = slots.late();
    MonoNs before = slots.next();
    for (int i = 0; i < 60; ++i) {
      const MonoNs slot = slots.next();
      slots.Take(slot);
      EXPECT_GE(slots.next() - slot, kMillisecond - kMillisecond / SlotClock::kSlewDivisor);
      EXPECT_LE(slots.next() - slot, kMillisecond + kMillisecond / SlotClock::kSlewDivisor);
      before = slot;
    }
    EXPECT_EQ((slots.next() + base.ahead) % kMillisecond, 0) << "after " << before;
    EXPECT_EQ(slots.Take(slots.next()), (slots.next() - kMillisecond + base.ahead) / kMillisecond);
    EXPECT_EQ(slots.late(), late);
  }
}

TEST(SlotClockTest, ATickThatIsNotKnownWellEnoughHasNoNumber) {
  FakeBase base;
  base.half_width = 200 * kMicrosecond;
  SlotClock slots({.period = kMillisecond}, &base);
  slots.Start(10 * kMillisecond);
  EXPECT_EQ(slots.Take(10 * kMillisecond), 10);
  base.half_width = 251 * kMicrosecond;
  EXPECT_EQ(slots.Take(11 * kMillisecond), kNoTick);
  base.half_width = 0;
  base.ahead = 300 * kMicrosecond;  // the slots have not followed yet
  EXPECT_EQ(slots.Take(12 * kMillisecond), kNoTick);
}

}  // namespace
}  // namespace axlecast
