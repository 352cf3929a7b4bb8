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

}  // namespace
}  // namespace axlecast
