#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/runtime/axis/motion.h"

namespace axlecast {
namespace {

class TurnCounterTest : public testing::Test {
 protected:
  static constexpr std::int64_t kPerTurn = 1'000;
  static constexpr std::int64_t kAll = 10 * kPerTurn;

  void Make(TurnsMode mode, std::int64_t turns_range = 10) {
    settings_->counts_per_turn = kPerTurn;
    settings_->turns_range = turns_range;
    device_.settings = settings_;
    device_.turns = mode;
    counter_.emplace(device_, MotionLimits(kPerTurn, 6'000, 0, 0));  // 100 counts in 1 ms
  }
  static Sample Read(MonoNs at, std::int64_t counts, bool has_turns = true) {
    Sample sample;
    sample.at = {at, at};
    sample.counts = counts % kPerTurn;
    sample.turns = has_turns ? static_cast<std::int32_t>(counts / kPerTurn) : 0;
    sample.has_turns = has_turns;
    return sample;
  }
  // Accepts `sample` after `from`, and returns its counts with the correction.
  UnwrappedSample Take(const UnwrappedSample& from, const Sample& sample) {
    TurnCounter::Unwrapped unwrapped = counter_->Follow(from, sample);
    last_ = counter_->Accept(unwrapped, sample);
    unwrapped.sample.counts += last_.correction;
    return unwrapped.sample;
  }

  std::shared_ptr<DeviceSettings> settings_ = std::make_shared<DeviceSettings>();
  DeviceConfig device_;
  std::optional<TurnCounter> counter_;
  TurnCounter::Change last_;
};

TEST_F(TurnCounterTest, TheFirstReadingIsNearestToTheDatum) {
  Make(TurnsMode::kModulo);
  EXPECT_EQ(counter_->First(Read(0, 9'900), std::nullopt).counts, 9'900);
  EXPECT_EQ(counter_->First(Read(0, 9'900), 100).counts, -100);
  EXPECT_EQ(counter_->First(Read(0, 900, false), 5'100).counts, 4'900) << "within half a turn without its turns";
  EXPECT_EQ(counter_->First(Read(0, 900, false), std::nullopt).counts, 900);
  Make(TurnsMode::kUnsigned);
  EXPECT_EQ(counter_->First(Read(0, 9'900), 100).counts, 9'900) << "the ends of the axis decide";
  Make(TurnsMode::kSigned);
  EXPECT_EQ(counter_->First(Read(0, 9'900), 5'000).counts, -100);
  EXPECT_EQ(counter_->First(Read(0, 900, false), std::nullopt).counts, -100);
}

TEST_F(TurnCounterTest, AfterALongGapTheEndsOfTheAxisDecide) {
  const auto after = [&](TurnsMode mode, MonoNs gap) {
    Make(mode);
    const Sample first = Read(0, 500);
    counter_->Begin(first, true);
    return counter_->Follow(counter_->First(first, std::nullopt), Read(gap, 9'000));
  };
  EXPECT_EQ(after(TurnsMode::kUnsigned, kSecond).sample.counts, 9'000);
  EXPECT_EQ(after(TurnsMode::kSigned, kSecond).sample.counts, -1'000);
  EXPECT_EQ(after(TurnsMode::kModulo, kSecond).sample.counts, -1'000);
  EXPECT_FALSE(after(TurnsMode::kModulo, kSecond).continuous);
  EXPECT_EQ(after(TurnsMode::kUnsigned, 20 * kMillisecond).sample.counts, -1'000) << "it can only be there";
  EXPECT_TRUE(after(TurnsMode::kUnsigned, 20 * kMillisecond).continuous);
  EXPECT_TRUE(after(TurnsMode::kUnsigned, 20 * kMillisecond).by_counter);
}

// Half of what repeats is 500 counts: 1 of quantisation, and 499 in 4.99 ms.
TEST_F(TurnCounterTest, ADistanceIsKnownIfLessThanHalfATurnIsPossible) {
  Make(TurnsMode::kModulo, 0);
  EXPECT_TRUE(counter_->Follow({0, {0, 0}}, Read(4'980 * kMicrosecond, 400, false)).continuous);
  EXPECT_FALSE(counter_->Follow({0, {0, 0}}, Read(4'990 * kMicrosecond, 400, false)).continuous) << "exactly half";
  EXPECT_FALSE(counter_->Follow({0, {0, 0}}, Read(5'000 * kMicrosecond, 400, false)).continuous);
}

TEST_F(TurnCounterTest, AnotherTurnIsBelievedAfterThreeEqualContradictions) {
  Make(TurnsMode::kModulo);
  const Sample first = Read(0, 2'000, false);
  counter_->Begin(first, true);
  EXPECT_FALSE(counter_->sure());
  UnwrappedSample at = counter_->First(first, std::nullopt);
  EXPECT_EQ(at.counts, 0);
  MonoNs t = 0;
  const auto take = [&](std::int64_t counts) {
    at = Take(at, Read(t += kMillisecond, counts));
    return at.counts;
  };
  EXPECT_EQ(take(2'000), 0);
  EXPECT_EQ(take(2'000), 0);
  EXPECT_EQ(take(3'000), 0) << "another contradiction is the first again";
  EXPECT_EQ(take(3'000), 0);
  EXPECT_FALSE(counter_->sure());
  EXPECT_TRUE(counter_->CountedByDriver(Read(t, 3'000)));
  EXPECT_EQ(take(3'000), 3'000);
  EXPECT_EQ(last_.correction, 3'000);
  EXPECT_FALSE(last_.was_sure);
  EXPECT_TRUE(counter_->sure());
  EXPECT_FALSE(counter_->CountedByDriver(Read(t, 3'000)));
  EXPECT_TRUE(counter_->CountedByDriver(Read(t, 3'000, false)));
  EXPECT_EQ(take(3'010), 3'010);
  EXPECT_EQ(last_.correction, 0);
}

TEST_F(TurnCounterTest, ContradictionsFromBeforeABeginDoNotCount) {
  Make(TurnsMode::kModulo);
  MonoNs t = 0;
  for (int begin = 0; begin < 2; ++begin) {
    const Sample first = Read(t += kMillisecond, 0, false);
    counter_->Begin(first, true);
    UnwrappedSample at = counter_->First(first, std::nullopt);
    for (int i = 0; i < 2; ++i) at = Take(at, Read(t += kMillisecond, 2'000));
    EXPECT_EQ(at.counts, 0) << begin;
  }
}

TEST_F(TurnCounterTest, ContradictionsOfAnotherGapDoNotCount) {
  Make(TurnsMode::kModulo);
  const Sample first = Read(0, 0);
  counter_->Begin(first, true);
  UnwrappedSample at = counter_->First(first, std::nullopt);
  MonoNs t = 0;
  for (const std::int64_t turns : {2, 4}) {
    at = Take(at, Read(t += kSecond, 0, false));
    for (int i = 0; i < 2; ++i) at = Take(at, Read(t += kMillisecond, turns * kPerTurn));
    EXPECT_EQ(at.counts, (turns - 2) * kPerTurn);
    at = Take(at, Read(t += kMillisecond, turns * kPerTurn));
    EXPECT_EQ(at.counts, turns * kPerTurn);
  }
}

TEST_F(TurnCounterTest, RepliesWithoutTurnsContradictNothing) {
  Make(TurnsMode::kModulo);
  const Sample first = Read(0, 0, false);
  counter_->Begin(first, true);
  UnwrappedSample at = counter_->First(first, std::nullopt);
  for (int ms = 1; ms <= 20; ++ms) at = Take(at, Read(ms * kMillisecond, ms * 75, false));
  for (int ms = 21; ms <= 25; ++ms) at = Take(at, Read(ms * kMillisecond, 1'500, false));
  EXPECT_EQ(at.counts, 1'500);
}

TEST_F(TurnCounterTest, ACounterThatAgreesIsBelievedAtOnce) {
  Make(TurnsMode::kModulo);
  const Sample first = Read(0, 0, false);
  counter_->Begin(first, true);
  UnwrappedSample at = counter_->First(first, std::nullopt);
  at = Take(at, Read(kMillisecond, 2'000));
  at = Take(at, Read(2 * kMillisecond, 2'000));
  at = Take(at, Read(3 * kMillisecond, 0));
  EXPECT_EQ(at.counts, 0);
  EXPECT_TRUE(counter_->sure());
}

TEST_F(TurnCounterTest, ACounterThatTheDeviceDoubtsIsNotSureUntilItIsTrustedAgain) {
  Make(TurnsMode::kModulo);
  Sample sample = Read(0, 2'000);
  counter_->Begin(sample, false);
  EXPECT_TRUE(counter_->sure()) << "the encoder itself has the turns";
  UnwrappedSample at = counter_->First(sample, std::nullopt);
  sample = Read(kMillisecond, 2'000);
  sample.turns_trusted = false;
  at = Take(at, sample);
  EXPECT_TRUE(last_.was_sure);
  EXPECT_FALSE(last_.lost_turns) << "the encoder may trust them again";
  EXPECT_FALSE(counter_->sure());
  EXPECT_TRUE(counter_->CountedByDriver(sample));
  counter_->Trust();
  at = Take(at, Read(2 * kMillisecond, 2'000, false));
  EXPECT_TRUE(counter_->sure()) << "a datum was set at this turn";
  at = Take(at, Read(3 * kMillisecond, 2'000));
  EXPECT_TRUE(counter_->sure());
  EXPECT_EQ(at.counts, 2'000);
}

TEST_F(TurnCounterTest, TheTurnsOfADatumStaySureWhileTheDeviceDoubtsItsCounter) {
  Make(TurnsMode::kModulo);
  Sample sample = Read(0, 2'000);
  sample.turns_trusted = false;
  counter_->Begin(sample, false);
  counter_->Trust();
  const UnwrappedSample at = counter_->First(sample, std::nullopt);
  sample.at = {kMillisecond, kMillisecond};
  static_cast<void>(Take(at, sample));
  EXPECT_TRUE(counter_->sure());
}

TEST_F(TurnCounterTest, ACounterThatTheDeviceDoubtsASecondTimeIsNotSure) {
  Make(TurnsMode::kModulo);
  Sample sample = Read(0, 2'000);
  counter_->Begin(sample, false);
  UnwrappedSample at = counter_->First(sample, std::nullopt);
  MonoNs t = 0;
  for (int i = 0; i < 2; ++i) {
    sample = Read(t += kMillisecond, 2'000);
    sample.turns_trusted = false;
    at = Take(at, sample);
    EXPECT_FALSE(counter_->sure()) << i;
    at = Take(at, Read(t += kMillisecond, 2'000));
    EXPECT_TRUE(counter_->sure()) << i;
  }
}

TEST_F(TurnCounterTest, ALongGapWithoutACounterThatIsTrustedLosesTheTurnsIfTheyWereSure) {
  for (const bool were_sure : {false, true}) {
    Make(TurnsMode::kModulo);
    Sample sample = Read(0, 2'000);
    sample.turns_trusted = false;
    counter_->Begin(sample, false);
    EXPECT_FALSE(counter_->sure());
    const UnwrappedSample at = counter_->First(sample, std::nullopt);
    if (were_sure) counter_->Trust();
    sample = Read(kSecond, 2'000, false);
    sample.turns_trusted = false;
    static_cast<void>(Take(at, sample));
    EXPECT_EQ(last_.lost_turns, were_sure);
    EXPECT_FALSE(counter_->sure());
  }
}

TEST_F(TurnCounterTest, WithoutACounterALongGapLosesTheTurnsOfAnAxisWithoutEnds) {
  for (const TurnsMode mode : {TurnsMode::kModulo, TurnsMode::kUnsigned}) {
    Make(mode, 1);
    EXPECT_FALSE(counter_->has_counter());
    EXPECT_EQ(counter_->OnlyCounted(), mode == TurnsMode::kModulo);
    const Sample first = Read(0, 100, false);
    counter_->Begin(first, mode == TurnsMode::kModulo);
    EXPECT_TRUE(counter_->sure());
    const UnwrappedSample at = counter_->First(first, std::nullopt);
    static_cast<void>(Take(at, Read(kMillisecond, 100, false)));
    EXPECT_FALSE(last_.lost_turns);
    static_cast<void>(Take(at, Read(kSecond, 100, false)));
    EXPECT_EQ(last_.lost_turns, mode == TurnsMode::kModulo);
    EXPECT_EQ(counter_->sure(), mode != TurnsMode::kModulo);
    counter_->Trust();
    counter_->Distrust();
    EXPECT_EQ(counter_->sure(), mode != TurnsMode::kModulo);
  }
}

TEST_F(TurnCounterTest, TheTurnsOfADatumAreOpenOnlyWithoutEnds) {
  Make(TurnsMode::kModulo);
  counter_->Begin(Read(0, 9'900), true);
  EXPECT_EQ(counter_->NearOrigin(9'900, 100), -100);
  Make(TurnsMode::kUnsigned);
  counter_->Begin(Read(0, 9'900), true);
  EXPECT_EQ(counter_->NearOrigin(9'900, 100), 9'900);
  Make(TurnsMode::kModulo);
  counter_->Begin(Read(0, 900, false), true);  // its counter has not been read
  EXPECT_EQ(counter_->NearOrigin(900, 5'100), 900);
  Make(TurnsMode::kModulo, 0);
  counter_->Begin(Read(0, 900, false), false);
  EXPECT_EQ(counter_->NearOrigin(900, 5'100), 4'900);
}

TEST_F(TurnCounterTest, BothEndsOfTheAxis) {
  Make(TurnsMode::kUnsigned);
  EXPECT_FALSE(counter_->Outside(0));
  EXPECT_TRUE(counter_->Outside(-1));
  EXPECT_FALSE(counter_->Outside(kAll - 1));
  EXPECT_TRUE(counter_->Outside(kAll));
  Make(TurnsMode::kSigned);
  EXPECT_FALSE(counter_->Outside(-kAll / 2));
  EXPECT_TRUE(counter_->Outside(-kAll / 2 - 1));
  EXPECT_FALSE(counter_->Outside(kAll / 2 - 1));
  EXPECT_TRUE(counter_->Outside(kAll / 2));
  Make(TurnsMode::kModulo);
  EXPECT_FALSE(counter_->Outside(100 * kAll));
}

}  // namespace
}  // namespace axlecast
