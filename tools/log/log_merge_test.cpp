#include "tools/log/log_merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/log/log_event.h"
#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

TEST(LogSpan, IsFromTheFirstMessageToTheLastEvent) {
  const RecordedLog one =
      RecordedLog().Add(90, std::string(kMachineChannel)).Add(20, "a").Add(70, "b").AddDamage(100);
  const RecordedLog other = RecordedLog().Add(10, "x").Add(30, "y");
  EXPECT_EQ(SpanOf({one.bytes()}).first, 20);
  EXPECT_EQ(SpanOf({one.bytes(), other.bytes()}).first, 10);
  EXPECT_EQ(SpanOf({other.bytes(), one.bytes()}).last, 70);
  EXPECT_EQ(SpanOf({Bytes()}).first, 0);
  EXPECT_EQ(SpanOf({Bytes()}).last, 0);
}

TEST(LogSpan, FindsTheLastEventOfALargeLog) {
  RecordedLog log;
  for (int i = 0; i < 50; ++i) log.Add(i, "large", std::string(10'000, 'x'));
  EXPECT_EQ(SpanOf({log.bytes()}).last, 49);
  EXPECT_EQ(SpanOf({log.Add(60, "huge", std::string(500'000, 'x')).bytes()}).last, 60);
}

using testing::ElementsAre;
using Channels = std::vector<std::string>;

Channels Rest(LogMerge& logs) {
  Channels channels;
  for (; logs.Head() != nullptr; logs.Advance()) channels.emplace_back(logs.Head()->channel);
  return channels;
}

TEST(LogMerge, IsOneSequenceByTime) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(30, "b").Add(50, "c");
  const RecordedLog other = RecordedLog().Add(20, "x").Add(40, "y").Add(45, "z");
  LogMerge logs({one.bytes(), other.bytes()});
  EXPECT_THAT(Rest(logs), ElementsAre("a", "x", "b", "y", "z", "c"));
}

TEST(LogMerge, TakesTheFirstNamedLogFirstWhereTimesAreEqual) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(20, "b");
  const RecordedLog other = RecordedLog().Add(10, "x").Add(10, "y").Add(20, "z");
  const RecordedLog third = RecordedLog().Add(10, "p");
  LogMerge logs({one.bytes(), other.bytes(), third.bytes()});
  EXPECT_THAT(Rest(logs), ElementsAre("a", "x", "y", "p", "b", "z"));
}

TEST(LogMerge, TellsOfWhichLogAnEventIs) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(40, "d");
  const RecordedLog other = RecordedLog().Add(20, "b").Add(30, "c");
  std::vector<std::size_t> from;
  for (LogMerge logs({one.bytes(), other.bytes()}); logs.Head() != nullptr; logs.Advance()) {
    from.push_back(logs.HeadLog());
  }
  EXPECT_THAT(from, ElementsAre(0, 1, 1, 0));
}

TEST(LogMerge, KeepsTheOrderOfALogWhoseTimesRunBack) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(5, "b").Add(7, "c");
  const RecordedLog other = RecordedLog().Add(6, "x");
  LogMerge logs({one.bytes(), other.bytes()});
  const Channels rest = Rest(logs);
  EXPECT_THAT(rest, testing::UnorderedElementsAre("a", "b", "c", "x"));
  EXPECT_LT(std::find(rest.begin(), rest.end(), "a"), std::find(rest.begin(), rest.end(), "b"));
  EXPECT_LT(std::find(rest.begin(), rest.end(), "b"), std::find(rest.begin(), rest.end(), "c"));
}

// Of three neighbours the middle one's time is damaged: it counts as one of the others', and its log is not put off.
TEST(LogMerge, DoesNotBelieveATimeThatStandsAlone) {
  for (const std::int64_t wrong : {INT64_MAX, INT64_MIN, INT64_C(0), INT64_C(1) << 55}) {
    const RecordedLog one = RecordedLog().Add(1'000, "a").Add(wrong, "b").Add(3'000, "c");
    const RecordedLog other = RecordedLog().Add(5'000, "x");
    LogMerge logs({one.bytes(), other.bytes()});
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

TEST(LogMerge, GoesToAPlaceAndEndsAtAnother) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(30, "b").Add(50, "c");
  const RecordedLog other = RecordedLog().Add(20, "x").Add(40, "y");
  LogMerge logs({one.bytes(), other.bytes()});
  const LogPosition begin = logs.Find(20);
  const LogPosition end = logs.Find(50);
  logs.Go(begin, end);
  EXPECT_EQ(logs.Position(), begin);
  EXPECT_THAT(Rest(logs), ElementsAre("x", "b", "y"));
  EXPECT_EQ(logs.Position(), end);
  logs.Go(logs.Find(51), logs.End());
  EXPECT_EQ(logs.Head(), nullptr);
}

TEST(LogMerge, PassesOverDamageAndCountsItOnce) {
  const RecordedLog one = RecordedLog().Add(10, "a").AddDamage(7).Add(30, "b").Add(50, "c").AddDamage(3);
  LogMerge logs({one.bytes()});
  for (int round = 0; round < 3; ++round) {
    logs.Go(logs.Begin(), logs.End());
    EXPECT_THAT(Rest(logs), ElementsAre("a", "b", "c"));
    EXPECT_EQ(logs.damage(), (LogMerge::DamageCount{2, 10}));
    EXPECT_THAT(logs.damage_of(0), ElementsAre(LogReader::Damage{29, 7}, LogReader::Damage{94, 3}));
  }
}

TEST(LogMerge, DoesNotCountDamageBehindTheEnd) {
  const RecordedLog one = RecordedLog().Add(10, "a").Add(20, "b").Add(30, "c").AddDamage(7).Add(40, "d");
  LogMerge logs({one.bytes()});
  logs.Go(logs.Begin(), logs.Find(30));
  EXPECT_THAT(Rest(logs), ElementsAre("a", "b"));
  EXPECT_EQ(logs.damage(), LogMerge::DamageCount());
}

TEST(LogMerge, OfNothingIsAtItsEnd) {
  LogMerge logs({Bytes(), Bytes()});
  EXPECT_EQ(logs.Head(), nullptr);
  EXPECT_EQ(logs.damage(), LogMerge::DamageCount());
}

}  // namespace

}  // namespace axlecast
