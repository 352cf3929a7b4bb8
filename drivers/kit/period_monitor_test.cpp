#include "drivers/kit/stream.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(CadenceTest, NothingIsExpectedBeforeTheStart) {
  PeriodMonitor cadence(100 * kMillisecond, 3);
  EXPECT_EQ(cadence.due(), kNever);
  EXPECT_FALSE(cadence.FellSilent(1'000 * kSecond));
}

TEST(CadenceTest, ReportsSilenceOnceAndAgainAfterTheStreamCameBack) {
  PeriodMonitor cadence(100 * kMillisecond, 3);
  cadence.Arrived(kSecond);
  EXPECT_EQ(cadence.due(), kSecond + 300 * kMillisecond);
  EXPECT_FALSE(cadence.FellSilent(kSecond + 300 * kMillisecond - 1));
  EXPECT_TRUE(cadence.FellSilent(kSecond + 300 * kMillisecond));
  EXPECT_TRUE(cadence.silent());
  EXPECT_FALSE(cadence.FellSilent(kSecond + 400 * kMillisecond));
  cadence.Arrived(2 * kSecond);
  EXPECT_FALSE(cadence.silent());
  EXPECT_TRUE(cadence.FellSilent(2 * kSecond + 301 * kMillisecond));
}

// An SAA on CAN set to 100 ms was seen sending every 106.4 ms (device-facts): three periods tolerate that for ever.
TEST(CadenceTest, ASlowStreamIsNotSilent) {
  PeriodMonitor cadence(100 * kMillisecond, 3);
  for (MonoNs now = 0; now < 60 * kSecond; now += 106'400 * kMicrosecond) {
    EXPECT_FALSE(cadence.FellSilent(now));
    cadence.Arrived(now);
  }
}

}  // namespace
}  // namespace axlecast
