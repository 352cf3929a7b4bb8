#include "drivers/runtime/command/command_authority.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

using Verdict = EpochFence::Verdict;

TEST(EpochFence, OnlyWhatIsNewerThanEverythingCounts) {
  EpochFence fence;
  EXPECT_EQ(fence.Judge(1, 0), Verdict::kOlder);
  EXPECT_EQ(fence.Judge(1, 5), Verdict::kNewest);
  EXPECT_EQ(fence.Judge(1, 5), Verdict::kOlder);
  EXPECT_EQ(fence.Judge(1, 4), Verdict::kOlder);
  EXPECT_EQ(fence.Judge(1, 6), Verdict::kNewest);
  EXPECT_EQ(fence.newest(), 6);
}

TEST(EpochFence, ABridgeNeverSeenBeforeMustBeAboveEveryOther) {
  EpochFence fence;
  EXPECT_EQ(fence.Judge(1, 100), Verdict::kNewest);
  EXPECT_EQ(fence.Judge(2, 1), Verdict::kOlder);
  EXPECT_EQ(fence.Judge(2, 100), Verdict::kOlder);
  EXPECT_EQ(fence.newest(), 100);
  EXPECT_EQ(fence.Judge(1, 101), Verdict::kNewest);  // the other has not taken over
  EXPECT_EQ(fence.Judge(2, 102), Verdict::kNewest);
  EXPECT_EQ(fence.Judge(1, 103), Verdict::kFenced);
  EXPECT_EQ(fence.newest(), 102);
}

TEST(EpochFence, ARecordingOfABridgeThatIsLongForgottenDoesNotAct) {
  EpochFence fence;
  for (std::int64_t boot = 1; boot <= 1'000; ++boot) EXPECT_EQ(fence.Judge(boot, boot), Verdict::kNewest);
  for (std::int64_t boot = 1; boot < 1'000; ++boot) EXPECT_NE(fence.Judge(boot, boot), Verdict::kNewest) << boot;
  EXPECT_EQ(fence.Judge(999, 999), Verdict::kFenced);
  EXPECT_EQ(fence.Judge(936, 936), Verdict::kFenced);
  EXPECT_EQ(fence.Judge(935, 935), Verdict::kOlder) << "64 replaced bridges are remembered, whoever invents more";
}

}  // namespace
}  // namespace axlecast
