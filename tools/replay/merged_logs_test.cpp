#include "tools/replay/merged_logs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/replay/recorded_log.h"

namespace axlecast {
namespace {

using testing::ElementsAre;
using Channels = std::vector<std::string>;

Channels Rest(MergedLogs& logs) {
  Channels channels;
  for (; logs.Head() != nullptr; logs.Advance()) channels.emplace_back(logs.Head()->channel);
  return channels;
}

TEST(MergedLogs, AreOneSequenceByTime) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(30, "b").Add(50, "c");
  const RecordedLog other = RecordedLog().Add(20, "x").Add(40, "y").Add(45, "z");
  MergedLogs logs({one.bytes(), other.bytes()});
  EXPECT_THAT(Rest(logs), ElementsAre("a", "x", "b", "y", "z", "c"));
}

TEST(MergedLogs, TakeTheFirstNamedLogFirstWhereTimesAreEqual) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(20, "b");
  const RecordedLog other = RecordedLog().Add(10, "x").Add(10, "y").Add(20, "z");
  const RecordedLog third = RecordedLog().Add(10, "p");
  MergedLogs logs({one.bytes(), other.bytes(), third.bytes()});
  EXPECT_THAT(Rest(logs), ElementsAre("a", "x", "y", "p", "b", "z"));
}

TEST(MergedLogs, KeepTheOrderOfALogWhoseTimesRunBack) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(5, "b").Add(7, "c");
  const RecordedLog other = RecordedLog().Add(6, "x");
  MergedLogs logs({one.bytes(), other.bytes()});
  const Channels rest = Rest(logs);
  EXPECT_THAT(rest, testing::UnorderedElementsAre("a", "b", "c", "x"));
  EXPECT_LT(std::find(rest.begin(), rest.end(), "a"), std::find(rest.begin(), rest.end(), "b"));
  EXPECT_LT(std::find(rest.begin(), rest.end(), "b"), std::find(rest.begin(), rest.end(), "c"));
}

// Of three neighbours the middle one's time is damaged: it counts as one of the others', and its log is not put off.
TEST(MergedLogs, DoNotBelieveATimeThatStandsAlone) {
  for (const std::int64_t wrong : {INT64_MAX, INT64_MIN, INT64_C(0), INT64_C(1) << 55}) {
    const RecordedLog one = RecordedLog().Add(1'000, "a").Add(wrong, "b").Add(3'000, "c");
    const RecordedLog other = RecordedLog().Add(5'000, "x");
    MergedLogs logs({one.bytes(), other.bytes()});
    std::vector<std::int64_t> times;
    Channels channels;
    for (; logs.Head() != nullptr; logs.Advance()) {
      times.push_back(logs.HeadUtime());
      channels.emplace_back(logs.Head()->channel);
    }
    EXPECT_THAT(channels, ElementsAre("a", "b", "c", "x"));
    EXPECT_THAT(times, ElementsAre(1'000, testing::AnyOf(1'000, 3'000), 3'000, 5'000)) << wrong;
  }
}

TEST(MergedLogs, GoToAPlaceAndEndAtAnother) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(30, "b").Add(50, "c");
  const RecordedLog other = RecordedLog().Add(20, "x").Add(40, "y");
  MergedLogs logs({one.bytes(), other.bytes()});
  const LogPosition begin = logs.Find(20);
  const LogPosition end = logs.Find(50);
  logs.Go(begin, end);
  EXPECT_EQ(logs.Position(), begin);
  EXPECT_THAT(Rest(logs), ElementsAre("x", "b", "y"));
  EXPECT_EQ(logs.Position(), end);
  logs.Go(logs.Find(51), logs.End());
  EXPECT_EQ(logs.Head(), nullptr);
}

TEST(MergedLogs, PassOverDamageAndCountItOnce) {
  const RecordedLog one = RecordedLog().Add(10, "a").AddDamage(7).Add(30, "b").Add(50, "c").AddDamage(3);
  MergedLogs logs({one.bytes()});
  for (int round = 0; round < 3; ++round) {
    logs.Go(logs.Begin(), logs.End());
    EXPECT_THAT(Rest(logs), ElementsAre("a", "b", "c"));
    EXPECT_EQ(logs.damage(), (MergedLogs::DamageCount{2, 10}));
  }
}

TEST(MergedLogs, DoNotCountDamageBehindTheEnd) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(20, "b").Add(30, "c").AddDamage(7).Add(40, "d");
  MergedLogs logs({one.bytes()});
  logs.Go(logs.Begin(), logs.Find(30));
  EXPECT_THAT(Rest(logs), ElementsAre("a", "b"));
  EXPECT_EQ(logs.damage(), MergedLogs::DamageCount());
}

TEST(MergedLogs, KnowWhenTheLastEventWas) {
  RecordedLog small = RecordedLog().Add(10, "a").Add(70, "b").AddDamage(100);
  RecordedLog large;
  for (int i = 0; i < 50; ++i) large.Add(i, "large", std::string(10'000, 'x'));
  EXPECT_EQ(MergedLogs({small.bytes(), large.bytes()}).LastUtime(), 70);
  EXPECT_EQ(MergedLogs({large.bytes()}).LastUtime(), 49);
  EXPECT_EQ(MergedLogs({large.Add(60, "huge", std::string(500'000, 'x')).bytes()}).LastUtime(), 60);
  EXPECT_EQ(MergedLogs({Bytes()}).LastUtime(), 0);
}

TEST(MergedLogs, OfNothingAreAtTheirEnd) {
  MergedLogs logs({Bytes(), Bytes()});
  EXPECT_EQ(logs.Head(), nullptr);
  EXPECT_EQ(logs.damage(), MergedLogs::DamageCount());
}

}  // namespace
}  // namespace axlecast
