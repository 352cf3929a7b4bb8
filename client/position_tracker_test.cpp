#include <axlecast/position_tracker.h>
#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>

namespace axlecast {
namespace {

using Answer = PositionTracker::Answer;
using Freshness = PositionTracker::Freshness;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kTurn = 131'072;
constexpr std::int32_t kGood = position_t::FLAG_VALID + position_t::FLAG_TURNS_VALID;

class PositionTrackerTest : public testing::Test {
 protected:
  // The next message of the publisher: read at `at`, received 0.2 ms later.
  PositionTracker::News Receive(std::int64_t at, std::int64_t counts, std::int32_t flags = kGood) {
    position_t message{};
    message.mono_ns = at;
    message.boot_id = boot_;
    message.machine_id = machine_;
    message.clock_id = clock_id_;
    message.seq = seq_++;
    message.time_uncertainty_ns = 2'000;
    message.counts_per_turn = kTurn;
    message.counts = counts;
    message.flags = flags;
    message.speed_rad_s = speed_;
    message.datum_epoch = epoch_;
    message.missed = missed_;
    return tracker_.OnPosition(message, at + kMs / 5);
  }
  void Device(double modulo = 0) {
    device_info_t info{};
    info.boot_id = boot_;
    info.machine_id = machine_;
    info.poll_us = publish_us_;
    info.publish_us = publish_us_;
    info.counts_per_turn = kTurn;
    info.ratio_num = 1;
    info.ratio_den = 1;
    info.per_turn = 360;
    info.modulo = modulo;
    info.max_age_us = std::max(20'000, 3 * publish_us_);
    tracker_.OnDevice(info);
  }

  PositionTracker tracker_;
  std::int64_t boot_ = 5;
  std::int64_t machine_ = IdOfName("press1");
  std::int64_t clock_id_ = OwnClockId();
  std::int32_t publish_us_ = 1'000;
  std::int64_t seq_ = 0;
  std::int32_t epoch_ = 0;
  std::int32_t missed_ = 0;
  double speed_ = std::nan("");
};

TEST_F(PositionTrackerTest, NothingYet) {
  EXPECT_EQ(tracker_.Check(0), Freshness::kNoReading);
  EXPECT_LT(tracker_.AgeNs(0), 0);
  EXPECT_EQ(tracker_.At(0).answer, Answer::kNoReading);
  EXPECT_FALSE(tracker_.At(0));
  EXPECT_TRUE(std::isnan(tracker_.At(0).counts));
}

TEST_F(PositionTrackerTest, AgeCountsFromTheSamplingInstant) {
  Receive(100 * kMs, 0);
  EXPECT_EQ(tracker_.Check(110 * kMs), Freshness::kLimitUnknown);
  EXPECT_EQ(tracker_.At(100 * kMs + 1).answer, Answer::kLimitUnknown);
  EXPECT_EQ(tracker_.Newest(101 * kMs).answer, Answer::kLimitUnknown);
  Device();
  EXPECT_EQ(tracker_.AgeNs(110 * kMs), 10 * kMs);
  EXPECT_EQ(tracker_.Check(120 * kMs), Freshness::kFresh);
  EXPECT_EQ(tracker_.Check(120 * kMs + 1), Freshness::kStale);
  EXPECT_EQ(tracker_.Check(98 * kMs), Freshness::kWrongClock);
}

TEST_F(PositionTrackerTest, TheInstantsOfAnotherHostAreNotKnown) {
  Device();
  clock_id_ = 77;
  EXPECT_FALSE(Receive(100 * kMs, 0).used);
  EXPECT_EQ(tracker_.Check(101 * kMs), Freshness::kOtherClock);
  EXPECT_EQ(tracker_.At(100 * kMs).answer, Answer::kOtherClock);
  clock_id_ = 0;  // not stated
  boot_ = 6;
  Receive(102 * kMs, 0);
  EXPECT_EQ(tracker_.Check(103 * kMs), Freshness::kOtherClock);
}

class OtherHostTest : public PositionTrackerTest {
 protected:
  static constexpr std::int64_t kOther = 77;
  static constexpr std::int64_t kAhead = 1'000'000 * kMs;  // of the clock of the other host

  OtherHostTest() {
    PositionTracker::Options options;
    options.clock_id = 5;
    options.time = &time_;
    options.max_time_half_width_ns = kMs;
    tracker_ = PositionTracker(options);
    clock_id_ = kOther;
    Device();
  }
  // TIME messages of both hosts at an instant of the clock of the caller.
  void Time(std::int64_t now, std::int32_t epoch = 0, std::int64_t half_width = 100'000) {
    for (const std::int64_t clock : {options_clock_, kOther}) {
      time_quality_t message{};
      message.clock_id = clock;
      message.boot_id = 1;
      message.mono_ns = clock == kOther ? now + kAhead : now;
      message.base_ns = now + 500 * kMs;
      message.base_id = 9;
      message.half_width_ns = clock == kOther ? half_width : 20;
      message.grade = time_quality_t::GRADE_PROVEN;
      message.growth_ppb = 600'000;
      message.valid_ms = 1'000;
      message.epoch = epoch;
      time_.OnTime(message, now);
    }
  }
  // A reading of the other host at an instant of the clock of the caller, received 0.2 ms later.
  PositionTracker::News ReceiveThere(std::int64_t at, std::int64_t counts) {
    position_t message{};
    message.mono_ns = at + kAhead;
    message.boot_id = boot_;
    message.machine_id = machine_;
    message.clock_id = kOther;
    message.seq = seq_++;
    message.counts_per_turn = kTurn;
    message.counts = counts;
    message.flags = kGood;
    return tracker_.OnPosition(message, at + kMs / 5);
  }

  TimeBase time_;
  std::int64_t options_clock_ = 5;
};

TEST_F(OtherHostTest, ReadingsAreUsedWithTheirTime) {
  Time(100 * kMs);
  EXPECT_TRUE(ReceiveThere(101 * kMs, 1'000).used);
  EXPECT_TRUE(ReceiveThere(103 * kMs, 3'000).used);
  EXPECT_EQ(tracker_.Check(104 * kMs), Freshness::kFresh);
  const auto position = tracker_.At(102 * kMs);
  ASSERT_TRUE(position);
  EXPECT_NEAR(position.counts, 2'000, 1);
  EXPECT_GT(position.timing_error_counts, 100) << "1 count per us, and 0.1 ms";
  EXPECT_LT(position.timing_error_counts, 200);
}

TEST_F(OtherHostTest, AnAgeIsTheGreatestThatItCanBe) {
  Time(100 * kMs);
  ReceiveThere(100 * kMs, 0);
  EXPECT_EQ(tracker_.Check(119 * kMs), Freshness::kFresh);
  EXPECT_EQ(tracker_.Check(120 * kMs), Freshness::kStale) << "it may be 0.1 ms older";
  EXPECT_EQ(tracker_.At(120 * kMs).answer, Answer::kStale);
  EXPECT_EQ(tracker_.Newest(120 * kMs).answer, Answer::kStale);
}

TEST_F(OtherHostTest, WithoutATimeThatIsGoodEnoughThereIsNoPosition) {
  EXPECT_FALSE(ReceiveThere(99 * kMs, 0).used);
  EXPECT_EQ(tracker_.Check(100 * kMs), Freshness::kTimeUnknown);
  EXPECT_EQ(tracker_.At(99 * kMs).answer, Answer::kTimeUnknown);
  Time(100 * kMs, 0, 2 * kMs);
  EXPECT_FALSE(ReceiveThere(101 * kMs, 0).used) << "wider than the options allow";
  Time(102 * kMs);
  EXPECT_TRUE(ReceiveThere(103 * kMs, 0).used);
  EXPECT_EQ(tracker_.Check(103 * kMs), Freshness::kFresh);
}

TEST_F(OtherHostTest, ReadingsOfTwoEpochsAreNotJoined) {
  Time(100 * kMs);
  ReceiveThere(101 * kMs, 1'000);
  Time(102 * kMs, 1);
  EXPECT_TRUE(ReceiveThere(103 * kMs, 3'000).used);
  EXPECT_EQ(tracker_.At(102 * kMs).answer, Answer::kBeforeHistory);
}

TEST_F(PositionTrackerTest, ATimeOfAnotherClockIsToldUntilAReadingProvesItRight) {
  Device();
  position_t message{};
  message.boot_id = boot_;
  message.clock_id = clock_id_;
  message.flags = kGood;
  message.mono_ns = 100 * kMs;
  tracker_.OnPosition(message, 10 * kMs);  // the caller's time is not CLOCK_MONOTONIC
  EXPECT_EQ(tracker_.Check(100 * kMs), Freshness::kWrongClock)
      << "also when its time has passed that of the reading";
  EXPECT_EQ(tracker_.At(100 * kMs).answer, Answer::kWrongClock);
  message.seq = 1;
  message.mono_ns = 101 * kMs;
  tracker_.OnPosition(message, 102 * kMs);
  EXPECT_EQ(tracker_.Check(103 * kMs), Freshness::kFresh);
}

TEST_F(PositionTrackerTest, NothingIsExtrapolatedFromAReadingThatIsTooOld) {
  PositionTracker::Options options;
  options.max_extrapolation_ns = 100 * kMs;
  tracker_ = PositionTracker(options);
  Device();  // 20 ms
  Receive(100 * kMs, 0);
  Receive(101 * kMs, 10);
  EXPECT_TRUE(tracker_.At(121 * kMs));
  EXPECT_EQ(tracker_.Check(122 * kMs), Freshness::kStale);
  EXPECT_EQ(tracker_.At(122 * kMs).answer, Answer::kStale);
}

TEST_F(PositionTrackerTest, AgeCanCountFromTheArrival) {
  PositionTracker::Options options;
  options.instant = PositionTracker::Options::Instant::kReceived;
  options.max_age_ns = 5 * kMs;
  clock_id_ = 77;
  tracker_ = PositionTracker(options);
  Receive(100 * kMs, 0);
  EXPECT_EQ(tracker_.AgeNs(101 * kMs), 800'000);
  EXPECT_EQ(tracker_.Check(106 * kMs), Freshness::kStale);
}

TEST_F(PositionTrackerTest, InvalidReadingsDoNotMakeItYounger) {
  Device();
  Receive(100 * kMs, 0);
  Receive(101 * kMs, 0, position_t::FLAG_IMPLAUSIBLE);
  EXPECT_EQ(tracker_.AgeNs(105 * kMs), 5 * kMs);
  EXPECT_EQ(tracker_.Check(105 * kMs), Freshness::kNotValid);
  EXPECT_EQ(tracker_.Check(130 * kMs), Freshness::kStale);
}

TEST_F(PositionTrackerTest, CountsLossLatenessAndMissedReadings) {
  Receive(100 * kMs, 0);
  seq_ = 5;
  missed_ = 3;
  EXPECT_EQ(Receive(101 * kMs, 0).lost, 4);
  seq_ = 2;
  const auto late = Receive(100 * kMs + 1, 0);
  EXPECT_FALSE(late.used);
  EXPECT_EQ(late.lost, 0);
  EXPECT_EQ(tracker_.totals().received, 3);
  EXPECT_EQ(tracker_.totals().lost, 4);
  EXPECT_EQ(tracker_.totals().late, 1);
  EXPECT_EQ(tracker_.totals().missed_readings, 3);
}

TEST_F(PositionTrackerTest, ARestartForgetsWhatWasBefore) {
  Device();
  Receive(100 * kMs, 1'000);
  boot_ = 6;
  seq_ = 0;
  const auto news = Receive(101 * kMs, 7, 0);
  EXPECT_TRUE(news.restarted);
  EXPECT_EQ(news.lost, 0);
  EXPECT_EQ(tracker_.totals().restarts, 1);
  EXPECT_EQ(tracker_.Check(101 * kMs), Freshness::kNoReading);
  EXPECT_EQ(tracker_.At(100 * kMs).answer, Answer::kBeforeHistory);
  EXPECT_FALSE(tracker_.totals().two_publishers);
  boot_ = 5;
  Receive(102 * kMs, 0);
  EXPECT_TRUE(tracker_.totals().two_publishers);
}

TEST_F(PositionTrackerTest, NothingIsAnsweredWhileTwoDriversPublish) {
  Device();
  for (int i = 0; i < 10; ++i) {
    boot_ = 5 + i % 2;
    seq_ = i / 2;
    Receive((100 + i) * kMs, i);
  }
  EXPECT_EQ(tracker_.Check(109 * kMs), Freshness::kTwoPublishers);
  EXPECT_EQ(tracker_.At(109 * kMs).answer, Answer::kTwoPublishers);
  for (int i = 10; i < 3'120; ++i) Receive((100 + i) * kMs, i);  // one of them has stopped
  EXPECT_EQ(tracker_.Check(3'219 * kMs), Freshness::kFresh);
  EXPECT_TRUE(tracker_.At(3'219 * kMs));
}

TEST_F(PositionTrackerTest, TheFirstMessageOfAnotherMachineIsAContradiction) {
  Device();
  Receive(100 * kMs, 1'000);
  machine_ = IdOfName("press2");
  boot_ = 6;
  seq_ = 0;
  Receive(101 * kMs, 77'000);
  EXPECT_EQ(tracker_.Check(101 * kMs), Freshness::kTwoPublishers);
  EXPECT_EQ(tracker_.At(101 * kMs).answer, Answer::kTwoPublishers);
}

TEST_F(PositionTrackerTest, ANamedMachineIsFollowedAlone) {
  PositionTracker::Options options;
  options.machine_id = IdOfName("press1");
  tracker_ = PositionTracker(options);
  Device();
  Receive(100 * kMs, 1'000);
  machine_ = IdOfName("press2");
  boot_ = 6;
  EXPECT_FALSE(Receive(101 * kMs, 77'000).used);
  EXPECT_EQ(tracker_.totals().other_machine, 1);
  EXPECT_EQ(tracker_.Check(101 * kMs), Freshness::kFresh);
  EXPECT_DOUBLE_EQ(tracker_.At(100 * kMs).counts, 1'000);
}

TEST_F(PositionTrackerTest, TheNewestReadingIsAnsweredWhileItIsFresh) {
  EXPECT_EQ(tracker_.Newest(0).answer, Answer::kNoReading);
  Device();
  Receive(100 * kMs, 1'000);
  const auto newest = tracker_.Newest(119 * kMs);
  EXPECT_EQ(newest.answer, Answer::kRead);
  EXPECT_DOUBLE_EQ(newest.counts, 1'000);
  EXPECT_EQ(tracker_.NewestInstantNs(), 100 * kMs);
  EXPECT_EQ(tracker_.Newest(121 * kMs).answer, Answer::kStale);
  Receive(122 * kMs, 0, position_t::FLAG_IMPLAUSIBLE);
  EXPECT_EQ(tracker_.Newest(123 * kMs).answer, Answer::kStale);
  Receive(124 * kMs, 5);
  Receive(125 * kMs, 0, position_t::FLAG_IMPLAUSIBLE);
  EXPECT_EQ(tracker_.Newest(126 * kMs).answer, Answer::kNotValid);
}

// After the newest reading, a position is answered only where it is fresh, whatever has come.
TEST_F(PositionTrackerTest, AtNeverAnswersWhereCheckDoesNot) {
  std::uint64_t random = 1;
  const auto below = [&random](std::uint64_t limit) {
    random = random * 6'364'136'223'846'793'005 + 1'442'695'040'888'963'407;
    return static_cast<std::int64_t>((random >> 33) % limit);
  };
  int answered = 0;
  for (int run = 0; run < 500; ++run) {
    PositionTracker::Options options;
    options.max_extrapolation_ns = below(2) == 0 ? -1 : below(100) * kMs;
    options.max_age_ns = below(3) == 0 ? below(50) * kMs : 0;
    tracker_ = PositionTracker(options);
    publish_us_ = static_cast<std::int32_t>(below(100'000));
    seq_ = 0;
    std::int64_t now = kMs * 1'000;
    for (int i = 0; i < 20; ++i) {
      if (below(8) == 0) Device();
      now += below(20) * kMs;
      boot_ = 5 + (below(30) == 0 ? 1 : 0);
      clock_id_ = below(30) == 0 ? 77 : OwnClockId();
      epoch_ = below(20) == 0 ? 1 : 0;
      const std::int64_t ahead = below(30) == 0 ? 5 * kMs : 0;
      Receive(now + ahead, below(1'000), below(6) == 0 ? position_t::FLAG_IMPLAUSIBLE : kGood);
      for (int query = 0; query < 4; ++query) {
        const std::int64_t instant = tracker_.NewestInstantNs() + 1 + below(150) * kMs;
        const auto position = tracker_.At(instant);
        answered += position ? 1 : 0;
        ASSERT_FALSE(position && tracker_.Check(instant) != Freshness::kFresh)
            << ReasonText(tracker_.Check(instant)) << ", run " << run;
        ASSERT_EQ(static_cast<bool>(tracker_.Newest(instant)), tracker_.Check(instant) == Freshness::kFresh);
      }
    }
  }
  EXPECT_GT(answered, 1'000);
}

// Every period of the tracker follows that of the device: a 10 Hz axis is usable.
TEST_F(PositionTrackerTest, ASlowAxisIsAnsweredBetweenItsMessages) {
  publish_us_ = 100'000;
  Device();
  Receive(1'000 * kMs, 0);
  Receive(1'100 * kMs, 1'000);
  EXPECT_DOUBLE_EQ(tracker_.At(1'050 * kMs).counts, 500);
  EXPECT_DOUBLE_EQ(tracker_.At(1'190 * kMs).counts, 1'900);
  EXPECT_EQ(tracker_.At(1'301 * kMs).answer, Answer::kTooFarAhead);
}

// It states neither a poll period nor a publish period that is as long as its own: only its maximum age follows from that.
TEST_F(PositionTrackerTest, ADeviceThatSendsByItselfIsAnsweredBetweenItsMessages) {
  device_info_t info{};
  info.boot_id = boot_;
  info.machine_id = machine_;
  info.counts_per_turn = kTurn;
  info.ratio_num = 1;
  info.ratio_den = 1;
  info.per_turn = 360;
  info.publish_us = 1'000;
  info.max_age_us = 60'000;
  tracker_.OnDevice(info);
  Receive(1'000 * kMs, 0);
  Receive(1'020 * kMs, 1'000);
  EXPECT_DOUBLE_EQ(tracker_.At(1'039 * kMs).counts, 1'950);
  EXPECT_EQ(tracker_.At(1'061 * kMs).answer, Answer::kTooFarAhead);
  EXPECT_EQ(tracker_.At(1'081 * kMs).answer, Answer::kStale);
}

TEST_F(PositionTrackerTest, InterpolatesBetweenTwoReadings) {
  Device();
  Receive(100 * kMs, 1'000);
  Receive(104 * kMs, 3'000, kGood + position_t::FLAG_REFERENCED);
  const auto position = tracker_.At(101 * kMs);
  ASSERT_EQ(position.answer, Answer::kInterpolated);
  EXPECT_DOUBLE_EQ(position.counts, 1'500);
  EXPECT_DOUBLE_EQ(position.value, 1'500 * 360.0 / kTurn);
  EXPECT_DOUBLE_EQ(position.timing_error_counts, 1);  // 500 counts per ms, 2 us
  EXPECT_EQ(position.flags, kGood);
  EXPECT_EQ(tracker_.At(100 * kMs).answer, Answer::kRead);
  EXPECT_DOUBLE_EQ(tracker_.At(104 * kMs).counts, 3'000);
  EXPECT_EQ(tracker_.At(99 * kMs).answer, Answer::kBeforeHistory);
}

TEST_F(PositionTrackerTest, TheValueWrapsAtTheModulo) {
  Device(360);
  Receive(100 * kMs, kTurn - 1'000);
  Receive(102 * kMs, kTurn + 3'000);
  EXPECT_DOUBLE_EQ(tracker_.At(101 * kMs).value, 1'000 * 360.0 / kTurn);
  EXPECT_DOUBLE_EQ(tracker_.At(100 * kMs).value, (kTurn - 1'000) * 360.0 / kTurn);
}

TEST_F(PositionTrackerTest, WithoutTheDeviceMessageOfThisBootTheValueIsUnknown) {
  Receive(100 * kMs, 1'000);
  EXPECT_TRUE(tracker_.At(100 * kMs));
  EXPECT_TRUE(std::isnan(tracker_.At(100 * kMs).value));
  Device();
  EXPECT_FALSE(std::isnan(tracker_.At(100 * kMs).value));
}

TEST_F(PositionTrackerTest, DoesNotInterpolateAcrossADatum) {
  Receive(100 * kMs, 1'000);
  epoch_ = 1;
  EXPECT_TRUE(Receive(101 * kMs, 0).datum_changed);
  EXPECT_EQ(tracker_.At(100 * kMs + 1).answer, Answer::kDatumChanged);
  EXPECT_TRUE(tracker_.At(101 * kMs));
  EXPECT_EQ(tracker_.totals().datum_changes, 1);
}

TEST_F(PositionTrackerTest, DoesNotInterpolateAcrossAChangeOfTrustInTheTurns) {
  Receive(100 * kMs, 1'000, position_t::FLAG_VALID);
  Receive(101 * kMs, 1'000 + kTurn);
  EXPECT_EQ(tracker_.At(100 * kMs + 1).answer, Answer::kDatumChanged);
}

TEST_F(PositionTrackerTest, DoesNotRestOnInvalidReadings) {
  Receive(100 * kMs, 0);
  Receive(101 * kMs, 77, position_t::FLAG_IMPLAUSIBLE);
  EXPECT_EQ(tracker_.At(100 * kMs + 1).answer, Answer::kNotValid);
  EXPECT_EQ(tracker_.At(101 * kMs).answer, Answer::kNotValid);
  EXPECT_EQ(tracker_.At(101 * kMs + 1).answer, Answer::kNotValid);
}

TEST_F(PositionTrackerTest, DoesNotInterpolateAcrossALongGap) {
  Receive(100 * kMs, 0);
  Receive(151 * kMs, 0);
  EXPECT_EQ(tracker_.At(120 * kMs).answer, Answer::kGap);
}

TEST_F(PositionTrackerTest, ExtrapolatesWithTheSpeedOfTheMessage) {
  Device();
  speed_ = 2 * 3.141592653589793 * 10;  // 10 turns/s
  Receive(100 * kMs, 0, kGood + position_t::FLAG_SPEED_VALID);
  const auto position = tracker_.At(102 * kMs);
  ASSERT_EQ(position.answer, Answer::kExtrapolated);
  EXPECT_NEAR(position.counts, 10 * kTurn * 0.002, 1e-6);
  EXPECT_TRUE(tracker_.At(105 * kMs));
  EXPECT_EQ(tracker_.At(105 * kMs + 1).answer, Answer::kTooFarAhead);
}

TEST_F(PositionTrackerTest, ExtrapolatesFromTwoReadingsElseNotAtAll) {
  Device();
  Receive(100 * kMs, 0);
  EXPECT_EQ(tracker_.At(101 * kMs).answer, Answer::kSpeedUnknown);
  Receive(101 * kMs, 100);
  EXPECT_DOUBLE_EQ(tracker_.At(103 * kMs).counts, 300);
  epoch_ = 1;
  Receive(102 * kMs, 5);
  EXPECT_EQ(tracker_.At(103 * kMs).answer, Answer::kSpeedUnknown);
}

TEST_F(PositionTrackerTest, KeepsTheLast64Messages) {
  for (int i = 0; i < 200; ++i) Receive((100 + i) * kMs, i);
  EXPECT_DOUBLE_EQ(tracker_.At(299 * kMs).counts, 199);
  EXPECT_DOUBLE_EQ(tracker_.At(236 * kMs).counts, 136);
  EXPECT_EQ(tracker_.At(235 * kMs).answer, Answer::kBeforeHistory);
}

TEST_F(PositionTrackerTest, TimeThatRunsBackwardsIsNotUsed) {
  Receive(100 * kMs, 0);
  EXPECT_FALSE(Receive(99 * kMs, 1).used);
  EXPECT_EQ(tracker_.totals().lost, 0);
  EXPECT_DOUBLE_EQ(tracker_.At(100 * kMs).counts, 0);
}

TEST_F(PositionTrackerTest, WildMessagesDoNotOverflow) {
  Receive(100 * kMs, INT64_MIN);
  for (const std::int64_t seq : {INT64_MAX, INT64_MIN}) {
    seq_ = seq;
    position_t message{};
    message.seq = seq;
    message.boot_id = boot_;
    message.mono_ns = seq;
    message.machine_id = machine_;
    message.clock_id = clock_id_;
    message.counts = INT64_MAX;
    message.flags = kGood;
    (void)tracker_.OnPosition(message, 0);
    (void)tracker_.At(100 * kMs + 1);
    (void)tracker_.At(INT64_MAX);
  }
  EXPECT_EQ(tracker_.totals().lost, INT64_C(1) << 31);
}

}  // namespace
}  // namespace axlecast
