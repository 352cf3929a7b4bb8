#include "drivers/runtime/axis/axis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "drivers/runtime/axis/axis_fixture.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;
constexpr std::int64_t kWhole = TestDevice::kTurn * TestDevice::kRange;
using Kind = AxisReading::Kind;

TEST_F(AxisTest, TheFirstReadingWaitsForTheSecond) {
  Make();
  EXPECT_EQ(Read(1'000).kind, Kind::kWithheld);
  const AxisReading second = Read(1'001);
  EXPECT_EQ(second.kind, Kind::kGood);
  EXPECT_EQ(second.counts, 1'001);
  EXPECT_EQ(second.flags, kUsable);
}

struct Walk {
  std::int64_t position;
  double speed = 0;
  // One step of `period` within 6,000 min-1 and 80,000 rad/s2; beyond 100 turns from `home` it turns round.
  void Step(std::mt19937_64& random, MonoNs period, std::int64_t home) {
    const double seconds = static_cast<double>(period) * 1e-9;
    const double counts_per_rad = static_cast<double>(kTurn) / (2 * std::numbers::pi);
    const double maximum = 80'000 * counts_per_rad * seconds * 0.9;
    double change = std::uniform_real_distribution<double>(-maximum, maximum)(random);
    if (position > home + 100 * kTurn) change = -maximum;
    if (position < home - 100 * kTurn) change = maximum;
    speed = std::clamp(speed + change, -100.0 * kTurn * 0.99, 100.0 * kTurn * 0.99);
    position += static_cast<std::int64_t>(speed * seconds);
  }
};

TEST_F(AxisTest, MultiTurnFollowsAWalkOfMillionsAcrossTheEndOfTheCounter) {
  Make();
  std::mt19937_64 random(3);
  Walk walk{kWhole - 3 * kTurn};
  std::int64_t crossings = 0;
  Settle(walk.position);
  for (int i = 0; i < 2'000'000; ++i) {
    const bool above = walk.position >= kWhole;
    walk.Step(random, kMillisecond, kWhole);
    crossings += above != (walk.position >= kWhole) ? 1 : 0;
    const AxisReading reading = Read(walk.position);
    ASSERT_EQ(reading.kind, Kind::kGood) << i;
    ASSERT_EQ(reading.counts, walk.position) << i;
    ASSERT_TRUE(Has(reading, position_t::FLAG_TURNS_VALID));
  }
  EXPECT_GT(crossings, 100);
}

TEST_F(AxisTest, SingleTurnFollowsAWalkOfMillions) {
  device_.settings->turns_range = 0;
  device_.config.direction = -1;
  Make();
  std::mt19937_64 random(4);
  Walk walk{kTurn / 2};
  Read(SingleTurn(walk.position));
  Read(SingleTurn(walk.position));
  for (int i = 0; i < 2'000'000; ++i) {
    walk.Step(random, kMillisecond, 1'000 * kTurn);
    const AxisReading reading = Read(SingleTurn(walk.position));
    ASSERT_EQ(reading.counts, -walk.position) << i;
    ASSERT_EQ(reading.flags, kUsable | position_t::FLAG_TURNS_COUNTED_BY_DRIVER);
  }
  EXPECT_GT(std::abs(walk.position), 100 * kTurn);
}

TEST_F(AxisTest, RepliesWithoutTheCounterAreCountedInBetween) {
  Make();
  std::mt19937_64 random(5);
  Walk walk{1'000 * kTurn};
  Settle(walk.position);
  for (int i = 0; i < 200'000; ++i) {
    walk.Step(random, kMillisecond, 1'000 * kTurn);
    const bool with_turns = i % 7 == 0;
    const AxisReading reading = Read(with_turns ? ReadingAt(t_, walk.position) : SingleTurn(walk.position));
    ASSERT_EQ(reading.counts, walk.position) << i;
    ASSERT_TRUE(Has(reading, position_t::FLAG_TURNS_VALID));
    ASSERT_EQ(Has(reading, position_t::FLAG_TURNS_COUNTED_BY_DRIVER), !with_turns);
  }
}

TEST_F(AxisTest, ModesReadTheCounterAsTheyAreDefined) {
  struct Case {
    TurnsMode mode;
    std::int64_t said;
    std::int64_t counts;
  };
  const Case cases[] = {
      {TurnsMode::kUnsigned, 0, 0},
      {TurnsMode::kUnsigned, 65'535 * kTurn, 65'535 * kTurn},
      {TurnsMode::kSigned, 32'767 * kTurn + 5, 32'767 * kTurn + 5},
      {TurnsMode::kSigned, 32'768 * kTurn, -32'768 * kTurn},
      {TurnsMode::kSigned, 65'535 * kTurn + kTurn - 1, -1},
      {TurnsMode::kModulo, 65'535 * kTurn, 65'535 * kTurn},
  };
  for (const Case& c : cases) {
    device_.config.turns = c.mode;
    Make();
    EXPECT_EQ(Settle(c.said).counts, c.counts);
  }
}

TEST_F(AxisTest, PassingTheEndGoesOnCountingAndSaysSo) {
  struct Case {
    TurnsMode mode;
    std::int64_t end;  // the first count outside
    bool outside;
  };
  const Case cases[] = {{TurnsMode::kUnsigned, kWhole, true},
                        {TurnsMode::kSigned, kWhole / 2, true},
                        {TurnsMode::kModulo, kWhole, false}};
  for (const Case& c : cases) {
    device_.config.turns = c.mode;
    Make();
    const AxisReading inside = Settle(c.end - 1);
    EXPECT_TRUE(Has(inside, position_t::FLAG_TURNS_VALID));
    const AxisReading outside = Read(c.end);
    EXPECT_EQ(outside.counts, c.end);
    EXPECT_EQ(axis_->outside(), c.outside);
    EXPECT_EQ(Has(outside, position_t::FLAG_TURNS_WRAPPED), c.outside);
    EXPECT_EQ(Has(outside, position_t::FLAG_TURNS_VALID), !c.outside);
    EXPECT_TRUE(Has(Read(c.end - 2), position_t::FLAG_TURNS_VALID));  // back again
  }
}

TEST_F(AxisTest, SingleTurnLosesItsTurnsWhenHalfATurnMayHavePassed) {
  device_.settings->turns_range = 0;
  for (const auto& [gap, kept] : {std::pair{4 * kMillisecond, true}, std::pair{6 * kMillisecond, false}}) {
    Make();
    Read(SingleTurn(100));
    Read(SingleTurn(100));
    t_ += gap - kMillisecond;  // half a turn at 6,000 min-1 takes 5 ms
    const AxisReading reading = Read(SingleTurn(100));
    EXPECT_TRUE(Has(reading, position_t::FLAG_VALID));
    EXPECT_EQ(Has(reading, position_t::FLAG_TURNS_VALID), kept);
    EXPECT_EQ(Has(Read(SingleTurn(100)), position_t::FLAG_TURNS_VALID), kept);
    Home(0);
    EXPECT_TRUE(Has(Read(SingleTurn(100)), position_t::FLAG_TURNS_VALID));
  }
}

TEST_F(AxisTest, TheCounterMendsWhatAGapBroke) {
  Make();
  Settle(10 * kTurn);
  Home(0);
  t_ += 20 * kMillisecond;
  const AxisReading unsure = Read(SingleTurn(11 * kTurn));  // one turn in 20 ms is possible
  EXPECT_TRUE(Has(unsure, position_t::FLAG_VALID));
  EXPECT_FALSE(Has(unsure, position_t::FLAG_TURNS_VALID));
  EXPECT_FALSE(Has(unsure, position_t::FLAG_REFERENCED));
  const std::int32_t epoch = axis_->reference().epoch();
  // A single damaged counter must not be believed: three that say the same are.
  EXPECT_EQ(Read(11 * kTurn).counts, 10 * kTurn);
  EXPECT_EQ(Read(11 * kTurn).counts, 10 * kTurn);
  const AxisReading mended = Read(11 * kTurn);
  EXPECT_EQ(mended.counts, 11 * kTurn);
  EXPECT_TRUE(Has(mended, position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(mended, position_t::FLAG_REFERENCED));
  EXPECT_EQ(axis_->reference().epoch(), epoch + 1);
}

TEST_F(AxisTest, TheCounterConfirmsWhatAGapLeftOpen) {
  Make();
  Settle(10 * kTurn);
  t_ += 20 * kMillisecond;
  EXPECT_FALSE(Has(Read(SingleTurn(10 * kTurn)), position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(Read(10 * kTurn), position_t::FLAG_TURNS_VALID));
  EXPECT_EQ(axis_->reference().epoch(), 0);
}

TEST_F(AxisTest, TurnsThatTheDeviceDoubtsAreCountedAndNotTrusted) {
  Make();
  Settle(5 * kTurn);
  const auto doubted = [&](std::int64_t said) {
    Sample sample = ReadingAt(t_, said);
    sample.turns_trusted = false;
    return sample;
  };
  AxisReading reading = Read(doubted(40'000 * kTurn));  // ME: a bit jumped in the counter
  EXPECT_TRUE(Has(reading, position_t::FLAG_VALID));
  EXPECT_EQ(reading.counts, 5 * kTurn);
  EXPECT_FALSE(Has(reading, position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(reading, position_t::FLAG_TURNS_COUNTED_BY_DRIVER));
  // After a datum the driver's own counting holds, as for an encoder without battery.
  Home(5 * kTurn);
  reading = Read(doubted(40'000 * kTurn));
  EXPECT_EQ(reading.counts, 0);
  EXPECT_TRUE(Has(reading, position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(reading, position_t::FLAG_REFERENCED));
  // The device trusts itself again, but says something else: what was referenced is not any more.
  for (int i = 0; i < 3; ++i) reading = Read(40'000 * kTurn);
  EXPECT_EQ(reading.counts, 40'000 * kTurn - 5 * kTurn - kWhole);  // the short way round
  EXPECT_TRUE(axis_->reference().lost());
  EXPECT_FALSE(Has(reading, position_t::FLAG_REFERENCED));
}

TEST_F(AxisTest, ADoubtedCounterThatIsWithinReachStillTellsTheTurnAfterAGap) {
  Make();
  Settle(5 * kTurn);
  t_ += 7 * kMillisecond;
  Sample sample = ReadingAt(t_, 5 * kTurn + 70'000);  // the short way would be backwards
  sample.turns_trusted = false;
  const AxisReading doubted = Read(sample);
  EXPECT_EQ(doubted.counts, 5 * kTurn + 70'000);
  EXPECT_FALSE(Has(doubted, position_t::FLAG_TURNS_VALID));
  const AxisReading trusted = Read(5 * kTurn + 80'000);  // it cannot have stopped within a millisecond
  EXPECT_EQ(trusted.counts, 5 * kTurn + 80'000);
  EXPECT_TRUE(Has(trusted, position_t::FLAG_TURNS_VALID));
  EXPECT_EQ(axis_->reference().epoch(), 0);
}

TEST_F(AxisTest, ADamagedCounterIsImplausible) {
  Make();
  Settle(5 * kTurn);
  const AxisReading reading = Read(6 * kTurn);
  EXPECT_EQ(reading.kind, Kind::kDoubtful);
  EXPECT_EQ(reading.flags, position_t::FLAG_IMPLAUSIBLE + 0);
  EXPECT_EQ(Read(5 * kTurn).kind, Kind::kGood);
}

TEST_F(AxisTest, AnExchangedEncoderIsANewEpochAndLosesTheReference) {
  Make();
  Settle(5 * kTurn);
  Home(0);
  const std::int32_t epoch = axis_->reference().epoch();
  Read(700 * kTurn);
  Read(700 * kTurn);
  EXPECT_EQ(axis_->reference().epoch(), epoch);
  EXPECT_EQ(axis_->Counts(), std::nullopt);
  const AxisReading reading = Read(700 * kTurn);
  EXPECT_EQ(reading.kind, Kind::kGood);
  EXPECT_EQ(reading.counts, 700 * kTurn);
  EXPECT_EQ(axis_->reference().epoch(), epoch + 1);
  EXPECT_TRUE(axis_->reference().lost());
  EXPECT_EQ(axis_->unexplained_jumps(), 1);
}

}  // namespace
}  // namespace axlecast
