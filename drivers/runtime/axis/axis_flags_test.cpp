#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "drivers/runtime/axis/axis_fixture.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;

struct FlagCase {
  const char* name;
  void (*change)(Sample& sample);
  TurnsMode mode;
  std::int32_t flags;
};

class AxisFlags : public AxisTest, public testing::WithParamInterface<FlagCase> {};

TEST_P(AxisFlags, FollowFromTheSample) {
  device_.config.turns = GetParam().mode;
  Make();
  Settle(5 * kTurn);
  Sample sample = ReadingAt(t_, 5 * kTurn);
  GetParam().change(sample);
  EXPECT_EQ(Read(sample).flags, GetParam().flags);
}

INSTANTIATE_TEST_SUITE_P(
    Table, AxisFlags,
    testing::Values(
        FlagCase{"good", [](Sample&) {}, TurnsMode::kModulo, kUsable},
        FlagCase{"warning", [](Sample& s) { s.warning = true; }, TurnsMode::kModulo, kUsable | 0x80},
        FlagCase{"low_accuracy", [](Sample& s) { s.low_accuracy = true; }, TurnsMode::kModulo, kUsable | 0x20},
        FlagCase{"error", [](Sample& s) { s.error = true; }, TurnsMode::kModulo, 0x40},
        FlagCase{"error_and_warning", [](Sample& s) { s.error = s.warning = true; }, TurnsMode::kModulo, 0xC0},
        FlagCase{"wrapped_modulo", [](Sample& s) { s.turns_wrapped = true; }, TurnsMode::kModulo, kUsable | 0x04},
        FlagCase{"wrapped_signed", [](Sample& s) { s.turns_wrapped = true; }, TurnsMode::kSigned, kUsable | 0x04},
        FlagCase{"wrapped_unsigned", [](Sample& s) { s.turns_wrapped = true; }, TurnsMode::kUnsigned, 0x01 | 0x04},
        FlagCase{"no_turns", [](Sample& s) { s.has_turns = false; }, TurnsMode::kModulo, kUsable | 0x200},
        FlagCase{"doubted_turns", [](Sample& s) { s.turns_trusted = false; }, TurnsMode::kModulo, 0x01 | 0x200},
        FlagCase{"implausible", [](Sample& s) { s.turns = 9; }, TurnsMode::kModulo, 0x100},
        FlagCase{"implausible_error", [](Sample& s) { s.turns = 9, s.error = true; }, TurnsMode::kModulo, 0x40}),
    [](const testing::TestParamInfo<FlagCase>& tested) { return std::string(tested.param.name); });

TEST_F(AxisTest, SpeedIsUnknownThenRight) {
  Make();
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
  Settle(0);
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
  // 1,500 min-1 = 25 turns/s = 157.08 rad/s, read every ms.
  std::int64_t position = 0;
  for (int ms = 1; ms <= 40; ++ms) {
    position = kTurn * 25 * ms / 1'000;
    Read(position);
  }
  EXPECT_NEAR(axis_->SpeedRadS(), 50 * std::numbers::pi, 0.02);
  Sample low = ReadingAt(t_, position);
  low.low_accuracy = true;
  Read(low);
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
}

// As on a Modbus line: far apart, and the instant known to a fifth of that only.
TEST_F(AxisTest, SpeedFromReadingsWithUncertainInstants) {
  Make();
  constexpr MonoNs kApart = 25 * kMillisecond;
  for (int i = 0; i < 20; ++i) {
    t_ += kApart;
    // 120 min-1 = 2 turns/s
    (void)axis_->Take(ReadingAt(t_, kTurn * 2 * 25 * i / 1'000, 5 * kMillisecond));
  }
  EXPECT_NEAR(axis_->SpeedRadS(), 4 * std::numbers::pi, 0.02);
  // Instants that are known to half a second tell no speed.
  t_ += kApart;
  (void)axis_->Take(ReadingAt(t_, kTurn, kSecond / 2));
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
}

TEST_F(AxisTest, SpeedAtTheFullRateOfTheWire) {
  Make();
  t_ = kSecond;
  // 19.6 kHz, 3,000 min-1, one count of noise: 50 turns/s = 314.159 rad/s.
  std::mt19937_64 random(6);
  for (int i = 0; i < 2'000; ++i) {
    const double turned = 50.0 * static_cast<double>(kTurn) * static_cast<double>(t_ - kSecond) * 1e-9;
    (void)axis_->Take(ReadingAt(t_, static_cast<std::int64_t>(turned) + static_cast<std::int64_t>(random() % 3)));
    t_ += 51 * kMicrosecond;
  }
  EXPECT_NEAR(axis_->SpeedRadS(), 100 * std::numbers::pi, 0.02);
}

}  // namespace
}  // namespace axlecast
