#include <gtest/gtest.h>

#include "drivers/kit/read_back.h"

namespace axlecast {
namespace {

TEST(ReadBack, AnEffectIsClaimedOnlyWhereTheDeviceReadDifferentlyBefore) {
  const Outcome seen = JudgeReadBack({.same_before = false, .confirmed = false}, "reads 0");
  EXPECT_EQ(seen.state, CommandState::kSucceeded);
  EXPECT_TRUE(seen.verified);
  EXPECT_EQ(seen.text, "reads 0");

  const Outcome confirmed = JudgeReadBack({.same_before = true, .confirmed = true}, "reads 0");
  EXPECT_EQ(confirmed.state, CommandState::kSucceeded);
  EXPECT_FALSE(confirmed.verified);
  EXPECT_NE(confirmed.text.find("no effect can be seen"), std::string::npos);

  const Outcome neither = JudgeReadBack({.same_before = true, .confirmed = false}, "reads 0");
  EXPECT_EQ(neither.state, CommandState::kIndeterminate);
  EXPECT_FALSE(neither.verified);
}

// A shaft that flickers from 11 to 10 counts was not zeroed by that, where 10 counts pass for 0.
TEST(ReadBack, AValueBesideTheToleranceCannotBeToldApart) {
  EXPECT_TRUE(CannotBeToldApart(0, 0, 10, 1024));
  EXPECT_TRUE(CannotBeToldApart(11, 0, 10, 1024));
  EXPECT_TRUE(CannotBeToldApart(1004, 0, 10, 1024));
  EXPECT_FALSE(CannotBeToldApart(21, 0, 10, 1024));
  EXPECT_FALSE(CannotBeToldApart(1003, 0, 10, 1024));
}

TEST(ReadBack, ADeviceAloneFindsThatItReadsAsAfterTheOperationNoMore) {
  EXPECT_EQ(FindingChange(FindingWord(true)).after, "reads_as_after");
  EXPECT_EQ(FindingChange(FindingWord(false)).after, "no_effect_seen");
}

TEST(ReadBack, WhatALookWouldHaveFoundBeforeIsToldWhileTheEffectIsOpen) {
  for (const auto& [state, told] : {std::pair{CommandState::kRunning, true},
                                    {CommandState::kIndeterminate, true},
                                    {CommandState::kSucceeded, false},
                                    {CommandState::kFailed, false}}) {
    const Outcome outcome = WithFindingBefore({.state = state}, true);
    ASSERT_EQ(outcome.changes.size(), told ? 1U : 0U);
    EXPECT_EQ(told ? outcome.changes[0].before : "reads_as_after", "reads_as_after");
  }
}

// 40" either way are 80" between two readings: 4.05 counts of 19.8" at 16 bits.
TEST(Accuracy, IsTwiceAsMuchBetweenTwoReadings) {
  EXPECT_EQ(NoiseOfAccuracy(40, 16), 5);
  EXPECT_EQ(NoiseOfAccuracy(20, 17), 5);
  EXPECT_EQ(NoiseOfAccuracy(15, 20), 25);
  EXPECT_EQ(NoiseOfAccuracy(5, 26), 518);
  EXPECT_EQ(NoiseOfAccuracy(5, 32), 33'141);
  EXPECT_EQ(NoiseOfAccuracy(40, 10), 1);
  EXPECT_EQ(NoiseOfAccuracy(0, 20), 1);
}

}  // namespace
}  // namespace axlecast
