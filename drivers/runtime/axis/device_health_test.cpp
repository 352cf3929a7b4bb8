#include "drivers/runtime/axis/device_health.h"

#include <gtest/gtest.h>

#include <axlecast/device_info_t.hpp>

namespace axlecast {
namespace {

constexpr int kStarting = device_info_t::STATE_STARTING;
constexpr int kOnline = device_info_t::STATE_ONLINE;
constexpr int kDegraded = device_info_t::STATE_DEGRADED;
constexpr int kOffline = device_info_t::STATE_OFFLINE;

class DeviceHealthTest : public testing::Test {
 protected:
  DeviceHealthTest() { health_.OnLink(true, "", t_); }
  int State() const { return health_.state(); }
  // `bad` failures in each hundred readings, 1 ms apart, with the ticks of the bus.
  void Run(int milliseconds, int bad, ErrorKind kind = ErrorKind::kChecksum) {
    for (int i = 0; i < milliseconds; ++i) {
      t_ += kMillisecond;
      if (i % 100 < bad) {
        health_.OnFailure(kind, t_);
      } else {
        health_.OnGood(t_);
      }
      if (i % 100 == 99) health_.Tick(t_);
    }
  }

  DeviceHealth health_{kMillisecond};
  MonoNs t_ = 1'000 * kSecond;
};

TEST_F(DeviceHealthTest, StartsAndGoesOnline) {
  EXPECT_EQ(State(), kStarting);
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
  EXPECT_EQ(health_.reason(), "");
}

TEST_F(DeviceHealthTest, PowerOnStandbyIsNoFault) {
  health_.OnStarting("power-on standby", t_);
  for (int i = 0; i < 19; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ += 100 * kMillisecond);
  EXPECT_EQ(State(), kStarting);
  health_.OnFailure(ErrorKind::kTimeout, t_ += 100 * kMillisecond);
  EXPECT_EQ(State(), kOffline);
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, TenFailuresOver100MillisecondsAreOffline) {
  Run(100, 0);
  for (int i = 0; i < 99; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ += kMillisecond);
  EXPECT_NE(State(), kOffline);
  health_.OnFailure(ErrorKind::kTimeout, t_ += kMillisecond);
  EXPECT_EQ(State(), kOffline);
  EXPECT_NE(health_.reason().find("timeout"), std::string::npos);
}

TEST_F(DeviceHealthTest, ASlowBusNeedsThreeFailuresOverASecond) {
  health_.OnGood(t_);
  for (int i = 0; i < 2; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ += 500 * kMillisecond);
  EXPECT_EQ(State(), kOnline);
  health_.OnFailure(ErrorKind::kTimeout, t_ += 500 * kMillisecond);
  EXPECT_EQ(State(), kOffline);
}

// Other work may have used its slots: it would perhaps have answered.
TEST_F(DeviceHealthTest, ADeviceThatIsNotAskedIsDegradedAndNeverOffline) {
  health_.OnGood(t_);
  health_.Tick(t_ + 900 * kMillisecond);
  EXPECT_EQ(State(), kOnline);
  health_.Tick(t_ + 1'100 * kMillisecond);
  EXPECT_EQ(State(), kDegraded);
  EXPECT_NE(health_.reason().find("not polled"), std::string::npos);
  health_.Tick(t_ + 3'600 * kSecond);
  EXPECT_EQ(State(), kDegraded);
  health_.OnFailure(ErrorKind::kTimeout, t_ += 3'601 * kSecond);
  EXPECT_EQ(State(), kOnline) << "one failure is no silence";
  health_.Tick(t_ += 2 * kSecond);
  EXPECT_EQ(State(), kDegraded);
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, FailuresCountFromTheLastReadingHoweverRareTheyAre) {
  health_.OnGood(t_);
  for (int i = 0; i < 3; ++i) {
    health_.Tick(t_ += 60 * kSecond);
    health_.OnFailure(ErrorKind::kTimeout, t_);
  }
  EXPECT_EQ(State(), kOffline);
}

TEST_F(DeviceHealthTest, OnePercentOfErrorsIsOnlineAndMoreIsDegraded) {
  Run(2'000, 1);
  EXPECT_EQ(State(), kOnline);
  Run(3'000, 3);
  EXPECT_EQ(State(), kDegraded);
  EXPECT_NE(health_.reason().find("3.0 % of the readings fail, most with checksum"), std::string::npos)
      << health_.reason();
  Run(3'000, 0);
  EXPECT_EQ(State(), kOnline);
}

// Four failures in 500 readings: 0.8 % in each second, between 0.5 % and 1 %.
TEST_F(DeviceHealthTest, BetweenTheTwoSharesTheStateStays) {
  const auto run_near_one_percent = [this] {
    for (int i = 0; i < 30; ++i) Run(100, i % 5 == 0 ? 0 : 1);
  };
  Run(2'000, 0);
  run_near_one_percent();
  EXPECT_EQ(State(), kOnline);
  Run(3'000, 3);
  ASSERT_EQ(State(), kDegraded);
  run_near_one_percent();
  EXPECT_EQ(State(), kDegraded) << "it has not fallen below 0.5 %";
  Run(3'000, 0);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, StrayBytesAreNoFailedReading) {
  health_.OnGood(t_);
  for (int i = 0; i < 300; ++i) health_.OnFailure(ErrorKind::kUnexpectedBytes, t_ += kMillisecond);
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
  EXPECT_EQ(health_.errors(ErrorKind::kUnexpectedBytes), 300);
}

// Garbage without pause, of which one reading in two hundred passes every check by chance.
TEST_F(DeviceHealthTest, GarbageWithoutPauseDoesNotFlap) {
  Run(1'000, 0);
  int changes = 0;
  int last = State();
  for (int i = 1; i <= 60'000; ++i) {
    t_ += kMillisecond;
    if (i % 200 == 0) {
      health_.OnGood(t_);
    } else {
      health_.OnFailure(ErrorKind::kChecksum, t_);
    }
    if (i % 100 == 0) health_.Tick(t_);
    changes += State() != last ? 1 : 0;
    last = State();
  }
  EXPECT_EQ(State(), kOffline);
  EXPECT_LE(changes, 2);
  Run(500, 0);
  EXPECT_EQ(State(), kDegraded) << "it answers again";
  Run(3'000, 0);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, ASilentDeviceIsBackWithItsFirstReading) {
  Run(1'000, 0);
  Run(1'000, 100, ErrorKind::kTimeout);
  EXPECT_EQ(State(), kOffline);
  Run(1, 0);
  EXPECT_NE(State(), kOffline);
}

TEST_F(DeviceHealthTest, ManyStrayBytesAreABurst) {
  Run(1'000, 0);
  for (int i = 0; i < 9; ++i) health_.OnFailure(ErrorKind::kUnexpectedBytes, t_);
  Run(1'100, 0);
  EXPECT_FALSE(health_.stray_burst());
  for (int i = 0; i < 20; ++i) health_.OnFailure(ErrorKind::kUnexpectedBytes, t_);
  Run(1'100, 0);
  EXPECT_TRUE(health_.stray_burst());
  Run(2'000, 0);
  EXPECT_FALSE(health_.stray_burst());
}

TEST_F(DeviceHealthTest, AnAlarmDegrades) {
  health_.OnGood(t_);
  health_.SetAlarm("battery_error");
  EXPECT_EQ(State(), kDegraded);
  EXPECT_EQ(health_.reason(), "alarm battery_error");
  health_.SetAlarm("");
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, ADeviceWhosePositionIsNeverValidIsDegradedNotOffline) {
  health_.OnGood(t_);
  for (int i = 0; i < 5'000; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ += kMillisecond);
  health_.Tick(t_);
  EXPECT_EQ(State(), kDegraded);
  health_.OnGood(t_);
  EXPECT_NE(health_.reason().find("readings fail"), 0U);
}

TEST_F(DeviceHealthTest, LinkDownAndUp) {
  health_.OnGood(t_);
  health_.OnLink(false, "no such port /dev/ttyUSB0: plug the adapter in", t_);
  EXPECT_EQ(State(), kOffline);
  EXPECT_EQ(health_.reason(), "no such port /dev/ttyUSB0: plug the adapter in");
  health_.OnFailure(ErrorKind::kIo, t_ += kSecond);
  EXPECT_EQ(State(), kOffline);
  health_.OnLink(true, "", t_);
  EXPECT_EQ(State(), kStarting);
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, ARefusedDeviceIsOfflineForItsReason) {
  health_.OnGood(t_);
  health_.OnRefused("ENID 23, configured 17: check the model", t_);
  EXPECT_EQ(State(), kOffline);
  EXPECT_EQ(health_.reason(), "ENID 23, configured 17: check the model");
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, RevisionChangesWithStateAndReasonOnly) {
  Run(1'000, 0);
  const std::int64_t revision = health_.revision();
  Run(5'000, 0);
  EXPECT_EQ(health_.revision(), revision);
  health_.SetAlarm("over_speed");
  EXPECT_EQ(health_.revision(), revision + 1);
}

TEST_F(DeviceHealthTest, ABurstOfImplausibleReadings) {
  Run(1'100, 0);
  EXPECT_FALSE(health_.implausible_burst());
  for (int i = 0; i < 10; ++i) health_.OnDoubtful(ErrorKind::kImplausible, t_);
  Run(1'100, 0);
  EXPECT_TRUE(health_.implausible_burst());
  Run(2'200, 0);
  EXPECT_FALSE(health_.implausible_burst());
}

// ---- at the limits ----

TEST_F(DeviceHealthTest, WhileItStartsThreeFailuresOverTwoSecondsAreOffline) {
  health_.OnStarting("power-on standby", t_);
  EXPECT_EQ(health_.reason(), "power-on standby");
  for (int i = 0; i < 2; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ += kSecond);
  EXPECT_EQ(State(), kStarting) << "two failures";
  health_.OnFailure(ErrorKind::kTimeout, t_);
  EXPECT_EQ(State(), kOffline);
}

TEST_F(DeviceHealthTest, StartingAgainForTheSameReasonChangesNothing) {
  health_.OnStarting("standby", t_);
  const std::int64_t revision = health_.revision();
  health_.OnFailure(ErrorKind::kTimeout, t_ += kSecond);
  health_.OnStarting("standby", t_);
  EXPECT_EQ(health_.revision(), revision);
  health_.OnStarting("warm-up", t_);
  EXPECT_EQ(health_.revision(), revision + 1);
  EXPECT_EQ(health_.reason(), "warm-up");
  health_.OnGood(t_);
  health_.OnStarting("warm-up", t_);
  EXPECT_EQ(State(), kStarting) << "after it was online";
}

TEST_F(DeviceHealthTest, ARefusalForAnotherReasonIsNew) {
  health_.OnRefused("wrong model", t_);
  const std::int64_t revision = health_.revision();
  health_.OnRefused("wrong model", t_);
  EXPECT_EQ(health_.revision(), revision);
  health_.OnRefused("wrong address", t_);
  EXPECT_EQ(State(), kOffline);
  EXPECT_EQ(health_.reason(), "wrong address");
  health_.OnGood(t_);
  health_.OnRefused("wrong address", t_);
  EXPECT_EQ(State(), kOffline);
}

TEST_F(DeviceHealthTest, ALinkThatIsDownForAnotherReasonHasTheNewOne) {
  health_.OnGood(t_);
  health_.OnLink(false, "unplugged", t_);
  EXPECT_EQ(health_.reason(), "unplugged");
  const std::int64_t revision = health_.revision();
  health_.OnLink(false, "unplugged", t_);
  EXPECT_EQ(health_.revision(), revision) << "for the same reason";
  health_.OnLink(false, "no permission", t_);
  EXPECT_EQ(health_.reason(), "no permission");
  health_.OnLink(true, "", t_);
  EXPECT_EQ(State(), kStarting);
  health_.OnGood(t_);
  health_.OnLink(true, "", t_);
  EXPECT_EQ(State(), kOnline) << "a link that stays up changes nothing";
}

TEST_F(DeviceHealthTest, ThreeDoubtfulReadingsOver100MillisecondsAreNoPosition) {
  health_.OnGood(t_);
  for (int i = 0; i < 2; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ += 50 * kMillisecond);
  EXPECT_EQ(State(), kOnline) << "two readings";
  health_.OnDoubtful(ErrorKind::kDevice, t_);
  EXPECT_EQ(State(), kDegraded);
  EXPECT_NE(health_.reason().find("no position is valid"), std::string::npos);
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
  health_.OnDoubtful(ErrorKind::kDevice, t_ += 100 * kMillisecond);
  EXPECT_EQ(State(), kOnline) << "the first in a row";
}

TEST_F(DeviceHealthTest, ManyDoubtfulReadingsWithin100MillisecondsAreStillOnline) {
  health_.OnGood(t_);
  for (int i = 0; i < 20; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ += 4 * kMillisecond);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, DoubtfulReadingsEndARowOfFailures) {
  health_.OnGood(t_);
  for (int i = 0; i < 9; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ += 20 * kMillisecond);
  health_.OnDoubtful(ErrorKind::kDevice, t_ += 20 * kMillisecond);
  for (int i = 0; i < 9; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ += 20 * kMillisecond);
  EXPECT_NE(State(), kOffline);
  health_.OnFailure(ErrorKind::kTimeout, t_ += 20 * kMillisecond);
  EXPECT_EQ(State(), kOffline);
}

TEST_F(DeviceHealthTest, AfterUndecodableBytesThreeRepliesInARowBringItBackDegraded) {
  health_.OnGood(t_);
  for (int i = 0; i < 10; ++i) health_.OnFailure(ErrorKind::kChecksum, t_ += 20 * kMillisecond);
  ASSERT_EQ(State(), kOffline);
  health_.OnGood(t_ += kMillisecond);
  health_.OnGood(t_ += kMillisecond);
  EXPECT_EQ(State(), kOffline) << "two may be chance";
  health_.OnFailure(ErrorKind::kChecksum, t_ += kMillisecond);
  health_.OnGood(t_ += kMillisecond);
  health_.OnGood(t_ += kMillisecond);
  EXPECT_EQ(State(), kOffline) << "not in a row";
  health_.OnGood(t_ += kMillisecond);
  EXPECT_EQ(State(), kDegraded);
  EXPECT_NE(health_.reason().find("it answers again after failures with checksum"), std::string::npos);
  for (int i = 0; i < 25; ++i) {
    health_.OnGood(t_ += 100 * kMillisecond);
    health_.Tick(t_);
  }
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, AfterUndecodableBytesItIsDegradedForAWholeSecond) {
  health_.OnGood(t_);
  health_.Tick(t_);
  for (int i = 1; i <= 10; ++i) health_.OnFailure(ErrorKind::kChecksum, t_ + i * 10 * kMillisecond);
  ASSERT_EQ(State(), kOffline);
  health_.Tick(t_ += kSecond);
  for (int i = 0; i < 3; ++i) health_.OnGood(t_ + 950 * kMillisecond);
  health_.Tick(t_ += kSecond);
  EXPECT_EQ(State(), kDegraded) << "it answers since 50 ms";
  health_.OnGood(t_ += 900 * kMillisecond);
  health_.Tick(t_ += 100 * kMillisecond);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, AStreamThatPausesIsOfflineAfterASecondAndTenPeriods) {
  health_.OnGood(t_);
  health_.OnFailure(ErrorKind::kSilent, t_);
  health_.Tick(t_ + kSecond + 10 * kMillisecond - 1);
  EXPECT_NE(State(), kOffline);
  health_.Tick(t_ + kSecond + 10 * kMillisecond);
  EXPECT_EQ(State(), kOffline);
}

TEST_F(DeviceHealthTest, ADeviceIsNotPolledAfterASecondAndTenPeriods) {
  health_.OnGood(t_);
  health_.Tick(t_ + kSecond + 10 * kMillisecond - 1);
  EXPECT_EQ(State(), kOnline);
  health_.Tick(t_ + kSecond + 10 * kMillisecond);
  EXPECT_EQ(State(), kDegraded);
  health_.OnDoubtful(ErrorKind::kDevice, t_ + 2 * kSecond);
  EXPECT_EQ(State(), kOnline) << "it was polled";
}

TEST_F(DeviceHealthTest, ThreeErrorsOfASecondMayBeManyAndTwoNever) {
  for (const int errors : {2, 3}) {
    DeviceHealth health(kMillisecond);
    MonoNs t = 1'000 * kSecond;
    health.OnGood(t);
    health.Tick(t);
    for (int i = 0; i < errors; ++i) health.OnFailure(ErrorKind::kChecksum, t);
    health.OnGood(t);
    health.Tick(t + kSecond);
    EXPECT_EQ(health.state(), errors == 3 ? kDegraded : kOnline) << errors;
    if (errors == 3) {
      EXPECT_EQ(health.reason(), "60.0 % of the readings fail, most with checksum");
    }
  }
}

TEST_F(DeviceHealthTest, TenStrayBytesOfASecondAreABurst) {
  for (const int strays : {9, 10}) {
    DeviceHealth health(kMillisecond);
    health.Tick(kSecond);
    for (int i = 0; i < strays; ++i) health.OnFailure(ErrorKind::kUnexpectedBytes, kSecond);
    health.Tick(2 * kSecond);
    EXPECT_EQ(health.stray_burst(), strays == 10);
    health.Tick(3 * kSecond);
    EXPECT_FALSE(health.stray_burst());
  }
}

// ---- silence at its limits ----

TEST_F(DeviceHealthTest, TenFailuresAndThreeFailuresNeedTheirTime) {
  for (const bool long_enough : {false, true}) {
    DeviceHealth ten(kMillisecond);
    ten.OnGood(kSecond);
    for (int i = 0; i < 9; ++i) ten.OnFailure(ErrorKind::kTimeout, kSecond + 200 * kMillisecond);
    EXPECT_EQ(ten.state(), kOnline) << "nine failures";
    DeviceHealth early(kMillisecond);
    early.OnGood(kSecond);
    const MonoNs lasted = 100 * kMillisecond - (long_enough ? 0 : 1);
    for (int i = 0; i < 10; ++i) early.OnFailure(ErrorKind::kTimeout, kSecond + lasted);
    EXPECT_EQ(early.state(), long_enough ? kOffline : kOnline);
    DeviceHealth slow(kMillisecond);
    slow.OnGood(kSecond);
    const MonoNs later = kSecond - (long_enough ? 0 : 1);
    for (int i = 0; i < 3; ++i) slow.OnFailure(ErrorKind::kTimeout, kSecond + later);
    EXPECT_EQ(slow.state(), long_enough ? kOffline : kOnline);
  }
}

TEST_F(DeviceHealthTest, ADeviceThatWasNeverReachedHasItsTimeFromTheFirstFailure) {
  DeviceHealth health(kMillisecond);
  for (int i = 0; i < 5; ++i) health.OnFailure(ErrorKind::kTimeout, t_);
  EXPECT_EQ(health.state(), kStarting);
  health.OnFailure(ErrorKind::kTimeout, t_ + 2 * kSecond - 1);
  EXPECT_EQ(health.state(), kStarting);
  health.OnFailure(ErrorKind::kTimeout, t_ + 2 * kSecond);
  EXPECT_EQ(health.state(), kOffline);
}

TEST_F(DeviceHealthTest, ADeviceThatWasNotPolledYetHasItsTimeFromTheFirstFailureToo) {
  DeviceHealth health(kMillisecond);
  health.Tick(t_);
  health.OnStarting(health.reason(), t_);
  for (int i = 0; i < 3; ++i) health.OnFailure(ErrorKind::kTimeout, t_ + 2 * kSecond);
  EXPECT_EQ(health.state(), kStarting);
}

TEST_F(DeviceHealthTest, AnotherReasonToStartDoesNotProlongTheStart) {
  health_.OnStarting("standby", t_);
  for (int i = 0; i < 2; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ += kSecond);
  health_.OnStarting("warm-up", t_);
  health_.OnFailure(ErrorKind::kTimeout, t_);
  EXPECT_EQ(State(), kOffline);
}

TEST_F(DeviceHealthTest, AStreamThatPausedIsBackWithItsFirstReading) {
  health_.OnGood(t_);
  health_.OnFailure(ErrorKind::kSilent, t_);
  health_.Tick(t_ += 2 * kSecond);
  ASSERT_EQ(State(), kOffline);
  EXPECT_NE(health_.reason().find("no usable answer; the last reading failed with silent"), std::string::npos)
      << health_.reason();
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
}

TEST_F(DeviceHealthTest, ATimeoutIsNoPauseOfAStream) {
  health_.OnGood(t_);
  health_.OnFailure(ErrorKind::kTimeout, t_);
  health_.Tick(t_ + 2 * kSecond);
  EXPECT_NE(State(), kOffline) << "one timeout";
}

TEST_F(DeviceHealthTest, ALinkThatComesUpIsNamedUntilSomethingIsRead) {
  EXPECT_EQ(health_.reason(), "the link is up; nothing read yet");
  DeviceHealth young(kMillisecond);
  EXPECT_EQ(young.reason(), "nothing read yet");
  EXPECT_EQ(young.revision(), 0);
  young.OnFailure(ErrorKind::kTimeout, t_);
  young.OnLink(true, "", t_);
  EXPECT_EQ(young.reason(), "nothing read yet") << "the link was up before";
}

TEST_F(DeviceHealthTest, AfterALostLinkTheFailuresAndTheDoubtBeginAnew) {
  health_.OnGood(t_);
  for (int i = 0; i < 5; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ += 50 * kMillisecond);
  ASSERT_EQ(State(), kDegraded);
  for (int i = 0; i < 9; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ += kMillisecond);
  health_.OnLink(false, "unplugged", t_);
  health_.OnLink(true, "", t_);
  health_.OnDoubtful(ErrorKind::kDevice, t_ += kMillisecond);
  EXPECT_EQ(State(), kOnline) << "one doubtful reading";
  health_.OnFailure(ErrorKind::kTimeout, t_ += 200 * kMillisecond);
  EXPECT_EQ(State(), kOnline) << "one failure";
}

TEST_F(DeviceHealthTest, TheFailuresFromBeforeALostLinkDoNotCountWhenItStarts) {
  health_.OnGood(t_);
  for (int i = 0; i < 2; ++i) health_.OnFailure(ErrorKind::kTimeout, t_);
  health_.OnLink(false, "unplugged", t_);
  health_.OnLink(true, "", t_);
  health_.OnFailure(ErrorKind::kTimeout, t_ + 2 * kSecond);
  EXPECT_EQ(State(), kStarting) << "one failure";
}

TEST_F(DeviceHealthTest, AfterALostLinkOneReplyBringsADeviceBackFromUndecodableBytes) {
  health_.OnGood(t_);
  for (int i = 0; i < 10; ++i) health_.OnFailure(ErrorKind::kChecksum, t_ += 20 * kMillisecond);
  ASSERT_EQ(State(), kOffline);
  health_.OnLink(false, "unplugged", t_);
  health_.OnLink(true, "", t_);
  health_.OnGood(t_);
  EXPECT_EQ(State(), kOnline);
}

// A device may state the same reason in two states.
TEST_F(DeviceHealthTest, AStateFollowsFromWhatHappenedAndNotFromItsReason) {
  health_.OnGood(t_);
  health_.OnStarting("restarted", t_);
  EXPECT_EQ(State(), kStarting);
  health_.OnRefused("restarted", t_);
  EXPECT_EQ(State(), kOffline);
  health_.OnStarting("restarted", t_);
  EXPECT_EQ(State(), kStarting);
  health_.OnLink(false, "restarted", t_);
  EXPECT_EQ(State(), kOffline);
}

TEST_F(DeviceHealthTest, ADoubtfulReadingIsAReadingForTheSilenceAndForThePolls) {
  health_.OnGood(t_);
  health_.OnDoubtful(ErrorKind::kDevice, t_ + 900 * kMillisecond);
  health_.Tick(t_ + 1'500 * kMillisecond);
  EXPECT_EQ(State(), kOnline) << "it was polled 0.6 s ago";
  for (int i = 0; i < 3; ++i) health_.OnFailure(ErrorKind::kTimeout, t_ + 1'500 * kMillisecond);
  EXPECT_EQ(State(), kOnline) << "it answered 0.6 s ago";
}

TEST_F(DeviceHealthTest, ADeviceThatBeginsWithDoubtfulReadingsHasNoPositionAfter100Milliseconds) {
  for (int i = 0; i < 3; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ + i * 50 * kMillisecond);
  EXPECT_EQ(State(), kDegraded);
  EXPECT_EQ(health_.reason(), "it answers, but no position is valid: device");
  const std::int64_t revision = health_.revision();
  health_.OnDoubtful(ErrorKind::kImplausible, t_ + 150 * kMillisecond);
  EXPECT_EQ(health_.revision(), revision) << "the first kind remains";
}

TEST_F(DeviceHealthTest, AFailureIsNotTheReasonWhyNoPositionIsValid) {
  health_.Tick(t_);
  for (int i = 0; i < 3; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ + i * 50 * kMillisecond);
  health_.OnFailure(ErrorKind::kTimeout, t_ + 150 * kMillisecond);
  health_.Tick(t_ + 200 * kMillisecond);
  EXPECT_EQ(health_.reason(), "it answers, but no position is valid: device");
  health_.SetAlarm("");
  EXPECT_EQ(health_.reason(), "it answers, but no position is valid: device");
}

TEST_F(DeviceHealthTest, AFailureIsNotTheReasonWhyNoPositionIsValidAfterASecondEither) {
  health_.Tick(t_);
  for (int i = 0; i < 3; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ += 50 * kMillisecond);
  health_.OnFailure(ErrorKind::kTimeout, t_);
  for (int i = 0; i < 1'500; ++i) {
    health_.OnDoubtful(ErrorKind::kDevice, t_ += kMillisecond);
    if (i % 100 == 99) health_.Tick(t_);
  }
  EXPECT_EQ(health_.reason(), "it answers, but no position is valid: device");
}

TEST_F(DeviceHealthTest, AValidReadingEndsARowOfDoubtfulOnes) {
  health_.OnGood(t_);
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 2; ++j) health_.OnDoubtful(ErrorKind::kDevice, t_ += 60 * kMillisecond);
    EXPECT_EQ(State(), kOnline);
    health_.OnGood(t_ += kMillisecond);
  }
}

TEST_F(DeviceHealthTest, DoubtfulRepliesBringADeviceBackFromUndecodableBytesToo) {
  health_.OnGood(t_);
  for (int i = 0; i < 10; ++i) health_.OnFailure(ErrorKind::kChecksum, t_ += 20 * kMillisecond);
  ASSERT_EQ(State(), kOffline);
  for (int i = 0; i < 2; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ += kMillisecond);
  EXPECT_EQ(State(), kOffline);
  health_.OnDoubtful(ErrorKind::kDevice, t_ += kMillisecond);
  EXPECT_EQ(State(), kDegraded);
}

// ---- the figures of a second ----

TEST_F(DeviceHealthTest, OnePercentIsNotMoreThanOnePercent) {
  for (const int good : {296, 297, 298}) {
    DeviceHealth health(kMillisecond);
    health.Tick(kSecond);
    health.OnGood(kSecond);
    for (int i = 0; i < 3; ++i) health.OnFailure(ErrorKind::kChecksum, kSecond);
    for (int i = 1; i < good; ++i) health.OnGood(kSecond);
    health.Tick(2 * kSecond - 1);
    EXPECT_EQ(health.state(), kOnline) << "the second is not over";
    health.Tick(2 * kSecond);
    EXPECT_EQ(health.state(), good < 297 ? kDegraded : kOnline) << good;
  }
}

TEST_F(DeviceHealthTest, TheMostFrequentKindOfFailureIsNamed) {
  health_.OnGood(t_);
  health_.Tick(t_);
  for (int i = 0; i < 3; ++i) health_.OnFailure(ErrorKind::kChecksum, t_);
  for (int i = 0; i < 4; ++i) health_.OnFailure(ErrorKind::kShort, t_);
  for (int i = 0; i < 9; ++i) health_.OnFailure(ErrorKind::kUnexpectedBytes, t_);
  for (int i = 0; i < 2; ++i) health_.OnGood(t_);
  health_.Tick(t_ + kSecond);
  EXPECT_EQ(health_.reason(), "70.0 % of the readings fail, most with short");
}

TEST_F(DeviceHealthTest, TenImplausibleReadingsOfASecondAreABurst) {
  for (const int implausible : {9, 10}) {
    DeviceHealth health(kMillisecond);
    health.Tick(kSecond);
    for (int i = 0; i < implausible; ++i) health.OnDoubtful(ErrorKind::kImplausible, kSecond);
    health.Tick(2 * kSecond);
    EXPECT_EQ(health.implausible_burst(), implausible == 10);
    health.Tick(3 * kSecond);
    EXPECT_FALSE(health.implausible_burst());
  }
}

TEST_F(DeviceHealthTest, ReadingsAreCounted) {
  EXPECT_EQ(health_.last_good(), kNever);
  health_.OnGood(t_);
  health_.OnGood(t_ + 5);
  health_.OnDoubtful(ErrorKind::kDevice, t_ + 6);
  EXPECT_EQ(health_.good(), 2);
  EXPECT_EQ(health_.last_good(), t_ + 5);
  EXPECT_EQ(health_.errors(ErrorKind::kDevice), 1);
}

TEST_F(DeviceHealthTest, WhatCountsMoreIsTheReason) {
  health_.OnGood(t_);
  health_.SetAlarm("battery_error");
  for (int i = 0; i < 3; ++i) health_.OnDoubtful(ErrorKind::kDevice, t_ += 60 * kMillisecond);
  EXPECT_NE(health_.reason().find("no position is valid"), std::string::npos);
  health_.OnGood(t_);
  EXPECT_EQ(health_.reason(), "alarm battery_error");
  health_.Tick(t_ + 3 * kSecond);
  EXPECT_NE(health_.reason().find("not polled"), std::string::npos);
}

}  // namespace
}  // namespace axlecast
