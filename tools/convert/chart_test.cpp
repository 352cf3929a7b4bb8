#include "tools/convert/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using testing::ElementsAre;

template <typename Ticks>
std::vector<std::string> Labels(const Ticks& ticks) {
  std::vector<std::string> labels;
  for (const Tick& tick : ticks) labels.push_back(tick.label);
  return labels;
}

TEST(RoundAxis, BeginsAndEndsAtRoundNumbers) {
  const RoundAxis axis = MakeRoundAxis(-0.97, 1.43, 5);
  EXPECT_THAT(Labels(axis.ticks), ElementsAre("-1.0", "-0.5", "0.0", "0.5", "1.0", "1.5"));
  EXPECT_EQ(axis.low, -1);
  EXPECT_EQ(axis.high, 1.5);
  EXPECT_THAT(Labels(MakeRoundAxis(0, 131'072, 5).ticks), ElementsAre("0", "50000", "100000", "150000"));
  EXPECT_THAT(Labels(MakeRoundAxis(0.00012, 0.00058, 5).ticks),
              ElementsAre("0.0001", "0.0002", "0.0003", "0.0004", "0.0005", "0.0006"));
}

TEST(RoundAxis, OneNumberAloneGetsRoom) {
  for (const double value : {0.0, 5.0, -1e15, 1e299, 1e-30}) {
    const RoundAxis axis = MakeRoundAxis(value, value, 5);
    EXPECT_LT(axis.low, axis.high) << value;
    EXPECT_LE(axis.low, value);
    EXPECT_GE(axis.high, value);
    EXPECT_LE(axis.ticks.size(), 12U);
  }
}

TEST(RoundAxis, AnySizes) {
  for (double size = 1e-200; size < 1e300; size *= 3.7) {
    const RoundAxis axis = MakeRoundAxis(-size, size * 0.7, 5);
    EXPECT_GE(axis.ticks.size(), 3U) << size;
    EXPECT_LE(axis.ticks.size(), 12U) << size;
  }
}

TEST(TimeAxis, TicksAtRoundTimesOfDay) {
  constexpr std::int64_t kFour = 1'763'740'800'000'000;  // 2025-11-21 16:00:00 UTC
  TimeAxis axis = MakeTimeAxis(kFour + 300'000, kFour + 2'000'000, 8);
  EXPECT_THAT(Labels(axis.ticks), ElementsAre("16:00:00.5", "16:00:01.0", "16:00:01.5", "16:00:02.0"));
  EXPECT_EQ(axis.title, "UTC, 2025-11-21");
  axis = MakeTimeAxis(kFour, kFour + 3'600'000'000, 6);
  EXPECT_THAT(Labels(axis.ticks), ElementsAre("16:00", "16:10", "16:20", "16:30", "16:40", "16:50", "17:00"));
  axis = MakeTimeAxis(kFour, kFour + 40, 4);
  EXPECT_THAT(Labels(axis.ticks), ElementsAre("16:00:00.00000", "16:00:00.00001", "16:00:00.00002",
                                              "16:00:00.00003", "16:00:00.00004"));
  axis = MakeTimeAxis(kFour, kFour + 345'600'000'000, 4);
  EXPECT_THAT(Labels(axis.ticks), ElementsAre("2025-11-22", "2025-11-23", "2025-11-24", "2025-11-25"));
  EXPECT_EQ(axis.title, "UTC, 2025-11-21 to 2025-11-25");
}

TEST(TimeAxis, OneInstantAndAllOfTime) {
  EXPECT_LE(MakeTimeAxis(5, 5, 8).ticks.size(), 1U);
  EXPECT_LE(MakeTimeAxis(0, 253'402'300'799'999'999, 8).ticks.size(), 10U);
}

}  // namespace
}  // namespace axlecast
