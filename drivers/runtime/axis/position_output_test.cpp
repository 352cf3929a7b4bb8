#include <gtest/gtest.h>
#include <axlecast/position_t.hpp>
#include <random>
#include <vector>

#include "drivers/runtime/axis/device_publisher.h"

namespace axlecast {
namespace {

constexpr std::int32_t kGood = 0x03;  // VALID, TURNS_VALID
constexpr MonoNs kWire = 51 * kMicrosecond;

int SentInOneSecond(PublishPace& pace, MonoNs period, MonoNs jitter) {
  std::mt19937_64 random(7);
  int sent = 0;
  for (MonoNs t = kSecond; t < 2 * kSecond; t += period) {
    const MonoNs at = t + (jitter > 0 ? static_cast<MonoNs>(random() % static_cast<std::uint64_t>(jitter)) : 0);
    sent += pace.Good(at, kGood, 0) ? 1 : 0;
  }
  return sent;
}

TEST(PublishPace, DecimatesToThePublishRate) {
  for (const double hz : {1.0, 10.0, 250.0, 1'000.0}) {
    PublishPace pace(hz, 0);
    EXPECT_NEAR(SentInOneSecond(pace, kWire, 0), hz, 1) << hz;
  }
}

TEST(PublishPace, JitterCostsNothing) {
  PublishPace decimated(1'000, 19'600);
  EXPECT_NEAR(SentInOneSecond(decimated, kWire, 30 * kMicrosecond), 1'000, 2);
  PublishPace every(1'000, 1'000);
  EXPECT_EQ(SentInOneSecond(every, kMillisecond, 400 * kMicrosecond), 1'000);
}

TEST(PublishPace, TheTicksThatAreMultiplesArePublished) {
  PublishPace pace(100, 1'000, 10);
  std::vector<std::int64_t> sent;
  for (std::int64_t tick = 3; tick < 60; ++tick) {
    if (tick == 20) continue;  // this reading failed
    if (pace.Good(tick * kMillisecond, kGood, 0, tick)) sent.push_back(tick);
  }
  EXPECT_EQ(sent, (std::vector<std::int64_t>{3, 10, 21, 30, 40, 50}))
      << "the first reading, and then the multiples of 10";
}

TEST(PublishPace, AnotherBaseOfTheTicksStopsNothing) {
  PublishPace pace(100, 1'000, 10);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0, 1'000'000));
  EXPECT_FALSE(pace.Good(kSecond + 1 * kMillisecond, kGood, 0, 1'000'001));
  EXPECT_TRUE(pace.Good(kSecond + 2 * kMillisecond, kGood, 0, 44));
  EXPECT_FALSE(pace.Good(kSecond + 3 * kMillisecond, kGood, 0, 45));
  EXPECT_TRUE(pace.Good(kSecond + 8 * kMillisecond, kGood, 0, 50));
  int sent = 0;
  for (int ms = 9; ms < 109; ++ms) sent += pace.Good(kSecond + ms * kMillisecond, kGood, 0) ? 1 : 0;
  EXPECT_NEAR(sent, 10, 1) << "without numbers";
}

TEST(PublishPace, ADoubtfulReadingGoesOnceAndThenAtTenHertz) {
  PublishPace pace(1'000, 1'000);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  int sent = 0;
  for (int ms = 1; ms <= 1'000; ++ms) sent += pace.Doubtful(kSecond + ms * kMillisecond) ? 1 : 0;
  EXPECT_EQ(sent, 10);
}

TEST(PublishPace, TheFirstGoodOneAfterItGoesAtOnce) {
  PublishPace pace(10, 1'000);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  EXPECT_FALSE(pace.Good(kSecond + 1 * kMillisecond, kGood, 0));
  EXPECT_TRUE(pace.Doubtful(kSecond + 2 * kMillisecond));
  EXPECT_TRUE(pace.Good(kSecond + 3 * kMillisecond, kGood, 0));
  EXPECT_FALSE(pace.Good(kSecond + 4 * kMillisecond, kGood, 0));
}

TEST(PublishPace, ALineThatFailsEveryOtherTimeDoesNotFlood) {
  PublishPace pace(100, 0);
  int sent = 0;
  for (MonoNs t = kSecond; t < 2 * kSecond; t += 2 * kWire) {
    sent += pace.Good(t, kGood, 0) ? 1 : 0;
    sent += pace.Doubtful(t + kWire) ? 1 : 0;
  }
  EXPECT_LE(sent, 310);
  EXPECT_GE(sent, 200);
}

TEST(PublishPace, AChangeOfStateGoesAtOnceButNotMoreThanEveryTenMilliseconds) {
  PublishPace pace(1, 1'000);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  const std::int32_t warned = kGood | position_t::FLAG_DEVICE_WARNING;
  EXPECT_TRUE(pace.Good(kSecond + 1 * kMillisecond, warned, 0));
  EXPECT_FALSE(pace.Good(kSecond + 2 * kMillisecond, warned, 0));
  EXPECT_FALSE(pace.Good(kSecond + 3 * kMillisecond, kGood, 0));
  EXPECT_TRUE(pace.Good(kSecond + 11 * kMillisecond, kGood, 0));
}

TEST(PublishPace, ANewEpochGoesAtOnce) {
  PublishPace pace(1, 1'000);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  EXPECT_TRUE(pace.Good(kSecond + 1 * kMillisecond, kGood, 1));
  EXPECT_TRUE(pace.Good(kSecond + 2 * kMillisecond, kGood, 2));
  EXPECT_FALSE(pace.Good(kSecond + 3 * kMillisecond, kGood, 2));
}

TEST(PublishPace, FlagsThatComeAndGoAreNoChangeOfState) {
  PublishPace pace(1, 0);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  const std::int32_t counted = kGood | position_t::FLAG_TURNS_COUNTED_BY_DRIVER;
  EXPECT_FALSE(pace.Good(kSecond + 20 * kMillisecond, counted, 0));
}

TEST(PublishPace, AtZeroHertzOnlyWhatIsNewIsPublished) {
  PublishPace pace(0, 0);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  EXPECT_FALSE(pace.Good(100 * kSecond, kGood, 0));
  PublishPace as_polled(0, 1'000);
  EXPECT_TRUE(as_polled.Good(kSecond, kGood, 0));
  EXPECT_FALSE(as_polled.Good(100 * kSecond, kGood, 0));
}

TEST(PublishPace, AtOneHertzAMessageIsDueAfterExactlyASecond) {
  PublishPace pace(1, 0);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  EXPECT_FALSE(pace.Good(2 * kSecond - 1, kGood, 0));
  EXPECT_TRUE(pace.Good(2 * kSecond, kGood, 0));
  PublishPace every(1, 1);
  EXPECT_TRUE(every.Good(kSecond, kGood, 0));
  EXPECT_TRUE(every.Good(kSecond + 1, kGood, 0)) << "as fast as it is polled";
}

TEST(PublishPace, EveryTickIsAMultipleOfOneAndZeroIsATick) {
  PublishPace every_tick(10, 1'000, 1);
  PublishPace tenth(10, 1'000, 10);
  int sent = 0;
  for (std::int64_t tick = 0; tick < 30; ++tick) {
    EXPECT_TRUE(every_tick.Good(kSecond + tick * kMillisecond, kGood, 0, tick));
    sent += tenth.Good(kSecond + tick * kMillisecond, kGood, 0, tick) ? 1 : 0;
  }
  EXPECT_EQ(sent, 3) << "0, 10 and 20";
  EXPECT_FALSE(tenth.Good(kSecond + 29 * kMillisecond, kGood, 0)) << "without a number, the period counts";
  EXPECT_FALSE(tenth.Good(kSecond + 119 * kMillisecond, kGood, 0));
  EXPECT_TRUE(tenth.Good(kSecond + 120 * kMillisecond, kGood, 0));
}

TEST(PublishPace, ATickIsPublishedOnce) {
  PublishPace pace(100, 1'000, 10);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0, 10));
  EXPECT_FALSE(pace.Good(kSecond + 1, kGood, 0, 10));
  EXPECT_TRUE(pace.Good(kSecond + 2, kGood, 0, 9))
      << "more than a message before it: the ticks are counted from elsewhere";
}

TEST(PublishPace, TicksDoNotMatterIfARateIsNoWholeNumberOfThem) {
  PublishPace pace(300, 1'000);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0, 0));
  EXPECT_FALSE(pace.Good(kSecond + 3 * kMillisecond, kGood, 0, 3));
  EXPECT_TRUE(pace.Good(kSecond + 4 * kMillisecond, kGood, 0, 4));
}

Interval At(MonoNs middle) { return {middle - 3'000, middle + 3'000}; }

TEST(Block, FortyReadingsFillIt) {
  Block block(131'072, 4, 5.0 / 131'072);
  EXPECT_TRUE(block.empty());
  for (int i = 0; i < 40; ++i) {
    const MonoNs at = kSecond + i * 51'000;
    ASSERT_FALSE(block.MustGoBefore(at, 2));
    ASSERT_FALSE(block.Full());
    block.Add(At(at), 100 + i, i, 2);
  }
  EXPECT_TRUE(block.Full());
  EXPECT_TRUE(block.MustGoBefore(kSecond + 40 * 51'000, 2));
  const position_block_t& message = block.message();
  EXPECT_EQ(message.n, 40);
  EXPECT_EQ(message.mono_ns, kSecond);
  EXPECT_EQ(message.datum_epoch, 2);
  EXPECT_EQ(message.counts_per_turn, 131'072);
  EXPECT_EQ(message.dt_ns[0], 0);
  EXPECT_EQ(message.dt_ns[39], 39 * 51'000);
  EXPECT_EQ(message.counts[39], 139);
  EXPECT_EQ(message.flags[39], 39);
  EXPECT_EQ(message.time_uncertainty_ns[39], 3'000);
  EXPECT_LE(message.getEncodedSize(), 1'400);
}

TEST(Block, NeverSpansTwoEpochs) {
  Block block(131'072, 1, 1);
  block.Add(At(kSecond), 1, 1, 0);
  EXPECT_FALSE(block.MustGoBefore(kSecond + 1, 0));
  EXPECT_TRUE(block.MustGoBefore(kSecond + 1, 1));
}

TEST(Block, NeverSpansMoreThan100Milliseconds) {
  Block block(131'072, 1, 1);
  EXPECT_FALSE(block.Waited(kSecond));
  block.Add(At(kSecond), 1, 1, 0);
  EXPECT_FALSE(block.MustGoBefore(kSecond + 100 * kMillisecond, 0));
  EXPECT_TRUE(block.MustGoBefore(kSecond + 100 * kMillisecond + 1, 0));
  EXPECT_FALSE(block.Waited(kSecond + 99 * kMillisecond));
  EXPECT_TRUE(block.Waited(kSecond + 100 * kMillisecond));
}

TEST(Block, TimeAscends) {
  Block block(131'072, 1, 1);
  block.Add(At(kSecond), 1, 1, 0);
  EXPECT_TRUE(block.MustGoBefore(kSecond, 0));
  EXPECT_TRUE(block.MustGoBefore(kSecond - 5, 0));
}

TEST(Block, CountsWhatWasMissedUntilItIsSent) {
  Block block(131'072, 1, 1);
  block.Miss();
  block.Miss();
  block.Add(At(kSecond), 1, 1, 0);
  EXPECT_EQ(block.message().missed, 2);
  block.Clear();
  EXPECT_TRUE(block.empty());
  EXPECT_EQ(block.message().missed, 0);
}

TEST(PublishPace, ARowOfDoubtfulReadingsBeginsAtMostEveryTenMilliseconds) {
  PublishPace pace(1, 0);
  EXPECT_TRUE(pace.Doubtful(kSecond)) << "the first one of all";
  EXPECT_TRUE(pace.Good(kSecond + 1, kGood, 0));
  EXPECT_FALSE(pace.Doubtful(kSecond + PublishPace::kExtraPeriod - 1));
  EXPECT_FALSE(pace.Good(kSecond + PublishPace::kExtraPeriod - 1, kGood, 0)) << "no doubtful one was published";
  EXPECT_TRUE(pace.Doubtful(kSecond + PublishPace::kExtraPeriod));
  EXPECT_FALSE(pace.Doubtful(kSecond + PublishPace::kExtraPeriod + PublishPace::kDoubtPeriod - 1));
  EXPECT_TRUE(pace.Doubtful(kSecond + PublishPace::kExtraPeriod + PublishPace::kDoubtPeriod));
}

TEST(PublishPace, AChangeOfStateWaitsTenMillisecondsAfterTheLastOne) {
  PublishPace pace(1, 0);
  const std::int32_t warned = kGood | position_t::FLAG_DEVICE_WARNING;
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  EXPECT_TRUE(pace.Good(kSecond + 1, warned, 0));
  EXPECT_FALSE(pace.Good(kSecond + PublishPace::kExtraPeriod, kGood, 0));
  EXPECT_TRUE(pace.Good(kSecond + 1 + PublishPace::kExtraPeriod, kGood, 0));
}

TEST(PublishPace, AfterAPauseAMessageIsDueAPeriodAfterTheNextReading) {
  PublishPace pace(100, 0);
  EXPECT_TRUE(pace.Good(kSecond, kGood, 0));
  EXPECT_TRUE(pace.Good(2 * kSecond, kGood, 0));
  EXPECT_FALSE(pace.Good(2 * kSecond + 10 * kMillisecond - 1, kGood, 0));
  EXPECT_TRUE(pace.Good(2 * kSecond + 10 * kMillisecond, kGood, 0));
  EXPECT_TRUE(pace.Good(2 * kSecond + 25 * kMillisecond, kGood, 0)) << "5 ms late";
  EXPECT_TRUE(pace.Good(2 * kSecond + 30 * kMillisecond, kGood, 0)) << "the next one is in time";
}

TEST(Block, ATimeThatIsTooUncertainIsLimited) {
  Block block(131'072, 1, 1);
  block.Add({0, 10 * kSecond}, 1, 1, 0);
  EXPECT_EQ(block.message().time_uncertainty_ns[0], INT32_MAX);
}

}  // namespace
}  // namespace axlecast
