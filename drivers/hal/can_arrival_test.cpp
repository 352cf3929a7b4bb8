#include "drivers/hal/can_socket.h"

#include <gtest/gtest.h>

#include "tests/support/fake_clock.h"

namespace axlecast {
namespace {

constexpr MonoNs kStart = 1'000 * kSecond;

class CanArrivalTest : public ::testing::Test {
 protected:
  CanArrivalTest() { arrival_.Start(); }

  // What CLOCK_REALTIME says now; ns.
  [[nodiscard]] std::int64_t Unix() const {
    return clock_.UtcMicroseconds() * kMicrosecond + clock_.Now() % kMicrosecond;
  }

  FakeClock clock_{kStart};
  CanArrival arrival_{clock_};
};

TEST_F(CanArrivalTest, TheStampIsFoundWithinAMicrosecond) {
  clock_.Advance(10 * kMillisecond + 123);
  const MonoNs truth = clock_.Now();
  const std::int64_t stamp = Unix();
  clock_.Advance(300 * kMicrosecond);
  const Interval at = arrival_.At(stamp);
  EXPECT_LE(at.first, truth);
  EXPECT_GE(at.last, truth);
  EXPECT_LE(at.last - at.first, kMicrosecond);
}

TEST_F(CanArrivalTest, ABatchKeepsItsOwnInstants) {
  std::int64_t stamps[3];
  MonoNs truths[3];
  for (int i = 0; i < 3; ++i) {
    clock_.Advance(500 * kMicrosecond);
    stamps[i] = Unix();
    truths[i] = clock_.Now();
  }
  clock_.Advance(20 * kMillisecond);
  for (int i = 0; i < 3; ++i) {
    const Interval at = arrival_.At(stamps[i]);
    EXPECT_LE(at.first, truths[i]);
    EXPECT_GE(at.last, truths[i]);
    EXPECT_LE(at.last - at.first, kMicrosecond);
  }
}

TEST_F(CanArrivalTest, WithoutAStampItCameSinceTheQueueWasEmpty) {
  clock_.Advance(kMillisecond);
  arrival_.Empty();
  clock_.Advance(2 * kMillisecond);
  EXPECT_EQ(arrival_.At(std::nullopt), (Interval{kStart + kMillisecond, kStart + 3 * kMillisecond}));
}

// A step between the stamp and the receive: forward, the frame seems to have come long ago; back, in the future.
TEST_F(CanArrivalTest, AStepOfUnixTimeNeverShowsInTheInstant) {
  for (const std::int64_t step_us : {std::int64_t{-3'600'000'000}, std::int64_t{-40}, std::int64_t{40},
                                     std::int64_t{500'000}, std::int64_t{3'600'000'000}}) {
    arrival_.Empty();
    const MonoNs empty = clock_.Now();
    clock_.Advance(5 * kMillisecond);
    const MonoNs truth = clock_.Now();
    const std::int64_t stamp = Unix();
    clock_.Advance(kMillisecond);
    clock_.StepUtc(step_us);
    const Interval at = arrival_.At(stamp);
    EXPECT_LE(at.first, truth) << step_us;
    EXPECT_GE(at.first, empty - kMicrosecond) << step_us;
    EXPECT_GE(at.last, truth) << step_us;
    EXPECT_LE(at.last, clock_.Now()) << step_us;
    // The next frame is exact again.
    clock_.Advance(kMillisecond);
    const Interval next = arrival_.At(Unix());
    EXPECT_LE(next.last - next.first, kMicrosecond) << step_us;
  }
}

TEST_F(CanArrivalTest, NeverBeforeItsForerunnerNorAfterNow) {
  clock_.Advance(kMillisecond);
  const Interval first = arrival_.At(Unix());
  clock_.Advance(kMillisecond);
  const Interval garbled = arrival_.At(Unix() - 500 * kMillisecond);
  EXPECT_GE(garbled.first, first.first);
  EXPECT_LE(garbled.last, clock_.Now());
  const Interval ahead = arrival_.At(Unix() + kSecond);
  EXPECT_GE(ahead.first, first.first);
  EXPECT_LE(ahead.last, clock_.Now());
}

}  // namespace
}  // namespace axlecast
