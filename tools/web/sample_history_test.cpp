#include "tools/web/sample_history.h"

#include <gtest/gtest.h>

#include <array>

namespace axlecast {
namespace {

void Fill(SampleHistory& history, std::int64_t from, std::int64_t to) {
  for (std::int64_t i = from; i < to; ++i) {
    const std::array<double, 2> row = {static_cast<double>(i), static_cast<double>(-i)};
    history.Add(i * 10, row);
  }
}

TEST(SampleHistory, KeepsTheNewestRowsUnderTheirNumbers) {
  SampleHistory history(2, 100);
  EXPECT_EQ(history.begin(), history.end());
  Fill(history, 0, 250);
  EXPECT_EQ(history.begin(), 150U);
  EXPECT_EQ(history.end(), 250U);
  for (std::uint64_t row = history.begin(); row < history.end(); ++row) {
    EXPECT_EQ(history.utime(row), static_cast<std::int64_t>(row) * 10);
    EXPECT_EQ(history.value(row, 0), static_cast<double>(row));
    EXPECT_EQ(history.value(row, 1), -static_cast<double>(row));
  }
}

TEST(SampleHistory, FindsARowByItsTime) {
  SampleHistory history(2, 100);
  EXPECT_EQ(history.Find(0), 0U);
  Fill(history, 0, 250);
  EXPECT_EQ(history.Find(0), 150U);
  EXPECT_EQ(history.Find(2000), 200U);
  EXPECT_EQ(history.Find(2001), 201U);
  EXPECT_EQ(history.Find(9999), 250U);
}

TEST(SampleHistory, ForgetsWhatACalendarSetBackMadeVoid) {
  SampleHistory history(2, 100);
  Fill(history, 100, 150);
  Fill(history, 20, 30);
  EXPECT_EQ(history.begin(), 50U);
  EXPECT_EQ(history.end(), 60U);
  EXPECT_EQ(history.utime(50), 200);
  Fill(history, 30, 200);
  EXPECT_EQ(history.end() - history.begin(), 100U);
  EXPECT_EQ(history.utime(history.begin()), 1000);
}

}  // namespace
}  // namespace axlecast
