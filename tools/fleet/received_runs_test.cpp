#include "tools/fleet/received_runs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

ReceivedRun RunOf(std::int64_t boot_id, std::int64_t first, std::int64_t last, std::int64_t t0, std::int64_t t1) {
  return {.channel = "POSITION/a", .boot_id = boot_id, .first_seq = first, .last_seq = last, .t0 = t0, .t1 = t1};
}

class ReceivedRunsTest : public testing::Test {
 protected:
  void On(std::int64_t boot_id, std::int64_t seq, std::int64_t received) {
    runs_.On(boot_id, seq, received, ended_);
  }

  ReceivedRuns runs_{"POSITION/a"};
  std::vector<ReceivedRun> ended_;
};

TEST_F(ReceivedRunsTest, NumbersWithoutAGapAreOneRun) {
  for (int i = 0; i < 5; ++i) On(7, 10 + i, 100 + i);
  EXPECT_THAT(ended_, IsEmpty());
  runs_.End(ended_);
  EXPECT_THAT(ended_, ElementsAre(RunOf(7, 10, 14, 100, 104)));
}

TEST_F(ReceivedRunsTest, AGapEndsARun) {
  On(7, 0, 100);
  On(7, 1, 101);
  On(7, 3, 103);
  EXPECT_THAT(ended_, ElementsAre(RunOf(7, 0, 1, 100, 101)));
  runs_.End(ended_);
  EXPECT_THAT(ended_, ElementsAre(RunOf(7, 0, 1, 100, 101), RunOf(7, 3, 3, 103, 103)));
}

TEST_F(ReceivedRunsTest, AMessageThatCameTwiceIsNoGap) {
  for (const int seq : {0, 1, 1, 0, 2}) On(7, seq, 100);
  runs_.End(ended_);
  EXPECT_THAT(ended_, ElementsAre(RunOf(7, 0, 2, 100, 100)));
}

TEST_F(ReceivedRunsTest, AMessageThatComesLateIsARunOfItsOwn) {
  for (const int seq : {0, 2, 1, 3}) On(7, seq, 100 + seq);
  runs_.End(ended_);
  EXPECT_THAT(ended_, ElementsAre(RunOf(7, 0, 0, 100, 100), RunOf(7, 2, 2, 102, 102), RunOf(7, 1, 1, 101, 101),
                                  RunOf(7, 3, 3, 103, 103)));
}

TEST_F(ReceivedRunsTest, EveryPublisherHasItsOwnNumbers) {
  On(7, 0, 100);
  On(8, 0, 101);
  On(7, 1, 102);
  On(8, 1, 103);
  runs_.End(ended_);
  EXPECT_THAT(ended_, ElementsAre(RunOf(7, 0, 1, 100, 102), RunOf(8, 0, 1, 101, 103)));
}

TEST_F(ReceivedRunsTest, AfterTheEndARunContinuesWithItsNewPart) {
  On(7, 0, 100);
  On(7, 1, 101);
  runs_.End(ended_);
  runs_.End(ended_);
  EXPECT_THAT(ended_, ElementsAre(RunOf(7, 0, 1, 100, 101)));
  On(7, 0, 102);  // received twice
  On(7, 2, 103);
  On(7, 1, 104);  // received twice
  On(7, 3, 105);
  runs_.End(ended_);
  On(7, 5, 106);
  runs_.End(ended_);
  EXPECT_THAT(ended_, ElementsAre(RunOf(7, 0, 1, 100, 101), RunOf(7, 2, 3, 103, 105), RunOf(7, 5, 5, 106, 106)));
}

TEST_F(ReceivedRunsTest, InventedPublishersNeedNoMemory) {
  for (int boot = 0; boot < 1'000; ++boot) On(boot, INT64_MAX, 100);
  runs_.End(ended_);
  EXPECT_THAT(ended_, SizeIs(1'000));
  On(7, INT64_MAX, 100);
  On(7, INT64_MIN, 100);
  EXPECT_THAT(ended_, SizeIs(1'001));
}

}  // namespace
}  // namespace axlecast
