#include "tools/replay/replay_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/log/log_header.h"
#include "tools/log/recorded_log.h"

namespace axlecast {
namespace {

constexpr std::int64_t kS = 1'000'000;
constexpr std::int64_t kBegin = 1'790'000'000 * kS;

// Ten events, a second apart, "0" to "9"; before them the recorder's own, much later than they.
class ReplayRangeTest : public testing::Test {
 protected:
  ReplayRangeTest() {
    log_.Add(kBegin + 5 * kS, std::string(kMachineChannel), "machine: a");
    for (int i = 0; i < 10; ++i) log_.Add(kBegin + i * kS, std::to_string(i));
  }

  std::string Played(const ReplayWish& wish) {
    range_ = FindRange({log_.bytes()}, wish);
    LogMerge logs({log_.bytes()});
    logs.Go(range_.begin, range_.end);
    std::string channels;
    for (; logs.Head() != nullptr; logs.Advance()) {
      if (!IsLogChannel(logs.Head()->channel)) channels += logs.Head()->channel;
    }
    EXPECT_EQ(range_.empty, channels.empty());
    return channels;
  }

  RecordedLog log_;
  ReplayRange range_;
};

TEST_F(ReplayRangeTest, IsEverythingWithoutAWish) {
  EXPECT_EQ(Played({}), "0123456789");
  EXPECT_EQ(range_.begin_utime, kBegin);
  EXPECT_EQ(range_.end_utime, kBegin + 9 * kS);
}

TEST_F(ReplayRangeTest, IsByTime) {
  EXPECT_EQ(Played({.from = kBegin + 3 * kS, .until = kBegin + 6 * kS}), "345");
  EXPECT_EQ(range_.begin_utime, kBegin + 3 * kS);
  EXPECT_EQ(range_.end_utime, kBegin + 6 * kS);
  EXPECT_EQ(Played({.from = kBegin + 7 * kS}), "789");
  EXPECT_EQ(Played({.until = kBegin + 7 * kS}), "0123456");
  EXPECT_EQ(Played({.from = kBegin + 8 * kS - 1}), "89");
  EXPECT_EQ(Played({.from = kBegin + 8 * kS + 1}), "9");
}

// The bookkeeping event is number 0, as in every stock reader.
TEST_F(ReplayRangeTest, IsByNumber) {
  EXPECT_EQ(Played({.start_event = 3, .end_event = 5}), "23");
  EXPECT_EQ(range_.end_utime, kBegin + 4 * kS);
  EXPECT_EQ(Played({.start_event = 0, .end_event = 3}), "01");
  EXPECT_EQ(Played({.start_event = 9}), "89");
}

TEST_F(ReplayRangeTest, IsWhatBothTimeAndNumberAllow) {
  EXPECT_EQ(Played({.from = kBegin + 3 * kS, .start_event = 2, .end_event = 7}), "345");
}

TEST_F(ReplayRangeTest, IsEmptyWhereNothingFits) {
  EXPECT_EQ(Played({.from = kBegin + 100 * kS}), "");
  EXPECT_EQ(Played({.until = 0}), "");
  EXPECT_EQ(Played({.start_event = 5, .end_event = 5}), "");
  EXPECT_EQ(Played({.start_event = 7, .end_event = 5}), "");
  EXPECT_EQ(Played({.start_event = 1'000}), "");
  EXPECT_EQ(Played({.from = kBegin + 6 * kS, .until = kBegin + 3 * kS}), "");
  EXPECT_EQ(Played({.from = INT64_MAX, .until = INT64_MIN}), "");
  EXPECT_TRUE(FindRange({Bytes()}, {}).empty);
}

TEST_F(ReplayRangeTest, CountsOverSeveralLogs) {
  const RecordedLog other = RecordedLog().Add(kBegin + kS / 2, "a").Add(kBegin + kS * 5 / 2, "b");
  const std::vector<Bytes> both = {log_.bytes(), other.bytes()};
  const ReplayRange range = FindRange(both, {.start_event = 2, .end_event = 6});
  LogMerge logs(both);
  logs.Go(range.begin, range.end);
  std::string channels;
  for (; logs.Head() != nullptr; logs.Advance()) channels += logs.Head()->channel;
  EXPECT_EQ(channels, "a12b");
}

}  // namespace
}  // namespace axlecast
