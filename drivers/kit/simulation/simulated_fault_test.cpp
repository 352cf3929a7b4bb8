#include "drivers/kit/simulation/simulated_fault.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace axlecast {
namespace {

using Kind = SimulatedFault::Kind;
using testing::HasSubstr;

TEST(SimulatorFaultTest, NamesWithAmountsAndDashes) {
  const Result<SimulatedFault> fault = ParseFault("bit_flip:0.01");
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->kind, Kind::kBitFlip);
  EXPECT_EQ(fault->amount, 0.01);
  const Result<SimulatedFault> dashed = ParseFault("bit-flip:0.001");
  ASSERT_TRUE(dashed);
  EXPECT_EQ(dashed->amount, 0.001);
  EXPECT_EQ(FaultText(*dashed), "bit_flip:0.001");
  for (const char* name :
       {"none", "off", "stuck", "garbage", "bit_flip", "slow", "delayed", "intermittent", "echo"}) {
    EXPECT_TRUE(ParseFault(name)) << name;
  }
}

TEST(SimulatorFaultTest, WhatIsWrongIsNamedAndChangesNothing) {
  const auto problem = [](std::string_view text) {
    const Result<SimulatedFault> fault = ParseFault(text);
    return fault ? std::string() : fault.error().text;
  };
  EXPECT_THAT(problem("broken"), HasSubstr("one of none, off"));
  EXPECT_THAT(problem("bit_flip:2"), HasSubstr("0 to 1"));
  EXPECT_THAT(problem("bit_flip:"), HasSubstr("is not a number"));
  EXPECT_THAT(problem("bit_flip:nan"), HasSubstr("is not a number"));
  EXPECT_THAT(problem("off:1"), HasSubstr("takes no amount"));
  EXPECT_THAT(problem(""), HasSubstr("is not a fault"));
}

// The number of flips of N bits at rate p is N p +- 5 sqrt(N p), every bit position alike.
TEST(SimulatorFaultTest, FlipsBitsAtTheRate) {
  constexpr double kRate = 0.01;
  constexpr int kFrames = 200'000;
  SeededRandom random(1);
  std::array<int, 88> flips{};
  for (int i = 0; i < kFrames; ++i) {
    std::array<std::uint8_t, 11> bytes{};
    FlipBits(bytes, 8, kRate, random);
    for (std::size_t bit = 0; bit < flips.size(); ++bit) flips[bit] += bytes[bit / 8] >> bit % 8 & 1;
  }
  for (std::size_t bit = 0; bit < flips.size(); ++bit) {
    EXPECT_NEAR(flips[bit], kFrames * kRate, 5 * std::sqrt(kFrames * kRate)) << bit;
  }
}

TEST(SimulatorFaultTest, AtRateOneEveryBitFlipsAndAtRateZeroNone) {
  SeededRandom random(1);
  std::array<std::uint8_t, 3> bytes{};
  EXPECT_TRUE(FlipBits(bytes, 9, 1, random));
  EXPECT_THAT(bytes, testing::Each(0xFF));
  EXPECT_FALSE(FlipBits(bytes, 9, 0, random));
  EXPECT_THAT(bytes, testing::Each(0xFF));
}

TEST(SimulatorFaultTest, TheSameSeedGivesTheSameDamage) {
  const SimulatedFault fault{Kind::kBitFlip, 0.1};
  std::array<std::uint8_t, 11> first{};
  std::array<std::uint8_t, 11> second{};
  SeededRandom one(42);
  SeededRandom two(42);
  EXPECT_EQ(Damage(first, fault, one), 11U);
  EXPECT_EQ(Damage(second, fault, two), 11U);
  EXPECT_EQ(first, second);
  EXPECT_THAT(first, testing::Contains(testing::Ne(0)));
}

TEST(SimulatorFaultTest, ShortLosesTheEnd) {
  SeededRandom random(3);
  std::array<std::uint8_t, 11> bytes{};
  for (int i = 0; i < 1'000; ++i) EXPECT_LT(Damage(bytes, {Kind::kShort, 1}, random), 11U);
  EXPECT_EQ(Damage(bytes, {Kind::kShort, 0}, random), 11U);
}

}  // namespace
}  // namespace axlecast
