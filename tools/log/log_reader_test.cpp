#include "tools/log/log_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tools/log/log_event.h"
#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(LogReader, AnEmptyLogHasNothingAndNoDamage) {
  const ReadLog read = ReadAll({});
  EXPECT_THAT(read.offsets, IsEmpty());
  EXPECT_THAT(read.damage, IsEmpty());
}

TEST(LogReader, GivesTheEventsInOrderWithTheirPlaces) {
  ScriptedLog log;
  log.Add("A", "one").Add("B", "two");
  LogReader reader(log.bytes());
  const auto one = reader.Next();
  ASSERT_TRUE(one);
  EXPECT_EQ(one->channel, "A");
  EXPECT_EQ(one->utime, ScriptedLog::kStart);
  EXPECT_EQ(reader.offset(), 0U);
  EXPECT_EQ(reader.position(), 32U);
  const auto two = reader.Next();
  ASSERT_TRUE(two);
  EXPECT_EQ(two->number, 1);
  EXPECT_EQ(reader.offset(), 32U);
  EXPECT_FALSE(reader.Next());
  EXPECT_EQ(reader.position(), log.bytes().size());
  EXPECT_FALSE(reader.Next()) << "the end stays the end";
}

TEST(LogReader, WhatIsNoLogIsDamageFromEndToEnd) {
  const std::vector<std::uint8_t> text(10'000, 'x');
  const ReadLog read = ReadAll(text);
  EXPECT_THAT(read.offsets, IsEmpty());
  EXPECT_THAT(read.damage, ElementsAre(LogReader::Damage{0, 10'000}));
}

TEST(LogReader, ALogWhoseHeadIsGoneIsReadFromItsFirstWholeEvent) {
  ScriptedLog log(5'000);
  log.Add("A", "one").Add("B", "two").Add("C", "three");
  for (std::size_t cut = 1; cut < log.offsets()[1]; ++cut) {
    const ReadLog read = ReadAll(Bytes(log.bytes()).subspan(cut));
    EXPECT_THAT(read.numbers, ElementsAre(5'001, 5'002)) << cut;
    EXPECT_THAT(read.damage, ElementsAre(LogReader::Damage{0, log.offsets()[1] - cut})) << cut;
  }
}

TEST(LogReader, ALogInTheDataOfADamagedEventIsNotTakenForEvents) {
  ScriptedLog other(40, ScriptedLog::kStart - 86'400'000'000);
  other.Add("OTHER", "1").Add("OTHER", "2").Add("OTHER", "3");
  ScriptedLog log;
  log.Add("A", "one").Add("LOG", other.bytes()).Add("B", "two");
  std::vector<std::uint8_t> bytes = log.bytes();
  bytes[log.offsets()[1]] = 0;
  EXPECT_EQ(ReadAll(bytes).offsets, (std::vector{log.offsets()[0], log.offsets()[2]}));
  bytes[log.offsets()[2]] = 0;
  EXPECT_EQ(ReadAll(bytes).offsets, std::vector{log.offsets()[0]});
}

TEST(LogReader, WhatAStockLoggerAppendsToATornLogIsRead) {
  ScriptedLog torn;
  torn.Add("A", "one").Add("A", "two").Add("A", "a longer one that is torn");
  ScriptedLog appended(0, ScriptedLog::kStart + 60'000'000);  // it counts from 0 again
  appended.Add("B", "three").Add("B", "four");
  std::vector<std::uint8_t> log(torn.bytes().begin(), torn.bytes().end() - 5);
  const std::size_t joint = log.size();
  log.insert(log.end(), appended.bytes().begin(), appended.bytes().end());
  const ReadLog read = ReadAll(log);
  EXPECT_THAT(read.numbers, ElementsAre(0, 1, 0, 1));
  EXPECT_THAT(read.damage, ElementsAre(LogReader::Damage{torn.offsets()[2], joint - torn.offsets()[2]}));
}

TEST(LogReader, BeginsAtTheNextRecordFromAnywhere) {
  ScriptedLog log(700);
  for (int i = 0; i < 40; ++i) log.Add("CHANNEL", std::string(30, 'x'));
  for (std::size_t begin = 1; begin < log.bytes().size(); ++begin) {
    LogReader reader(log.bytes(), begin);
    const auto event = reader.Next();
    const auto expected = std::ranges::lower_bound(log.offsets(), begin);
    if (expected == log.offsets().end()) {
      EXPECT_FALSE(event) << begin;
    } else {
      ASSERT_TRUE(event) << begin;
      EXPECT_EQ(reader.offset(), *expected) << begin;
    }
    EXPECT_THAT(reader.damage(), IsEmpty()) << begin;
  }
  LogReader reader(log.bytes(), log.bytes().size() + 5);
  EXPECT_FALSE(reader.Next());
}

// Each of these would take many minutes if a byte of it were looked at once for every byte before it.
TEST(LogReader, TakesTimeInProportionToAHostileLog) {
  constexpr std::size_t kSize = 2U << 20;
  std::vector<std::uint8_t> syncs;
  while (syncs.size() < kSize) AppendBigEndian(syncs, kEventSync);
  EXPECT_EQ(ReadAll(syncs).covered, syncs.size());

  // Headers, each of a record that reaches as far as it can, over all the others.
  std::vector<std::uint8_t> reaching;
  while (reaching.size() < kSize) {
    AppendEvent(reaching, {.number = 7, .utime = 1, .channel = "A", .data = {}});
    const std::size_t left = std::min(kSize - reaching.size(), kSize - kSize / 3);
    reaching[reaching.size() - 5] = static_cast<std::uint8_t>(left >> 24U);
    reaching[reaching.size() - 4] = static_cast<std::uint8_t>(left >> 16U);
    reaching[reaching.size() - 3] = static_cast<std::uint8_t>(left >> 8U);
    reaching[reaching.size() - 2] = static_cast<std::uint8_t>(left);
  }
  EXPECT_EQ(ReadAll(reaching).covered, reaching.size());

  // Records whose numbers have no order.
  std::vector<std::uint8_t> numbers;
  for (std::int64_t i = 0; numbers.size() < kSize; ++i) {
    AppendEvent(numbers, {.number = i * 7'919 % 1'000, .utime = -i, .channel = "A", .data = {}});
  }
  EXPECT_EQ(ReadAll(numbers).covered, numbers.size());
  numbers.erase(numbers.begin());
  EXPECT_EQ(ReadAll(numbers).covered, numbers.size());
}

TEST(SeekTime, FindsTheFirstEventNotBefore) {
  ScriptedLog log;
  for (int i = 0; i < 1'000; ++i) log.Add("CHANNEL", std::string(static_cast<std::size_t>(i % 50), 'x'));
  EXPECT_EQ(SeekTime(log.bytes(), INT64_MIN), 0U);
  EXPECT_EQ(SeekTime(log.bytes(), INT64_MAX), log.bytes().size());
  for (std::size_t i = 0; i < 1'000; ++i) {
    const std::int64_t utime = ScriptedLog::kStart + static_cast<std::int64_t>(i) * 1'000;
    EXPECT_EQ(SeekTime(log.bytes(), utime), log.offsets()[i]);
    EXPECT_EQ(SeekTime(log.bytes(), utime - 999), log.offsets()[i]);
  }
  EXPECT_EQ(SeekTime({}, 0), 0U);
}

TEST(SeekTime, StandsTimesThatRunBackALittle) {
  std::vector<std::uint8_t> log;
  std::vector<std::pair<std::int64_t, std::size_t>> events;
  for (std::int64_t i = 0; i < 5'000; ++i) {
    const std::int64_t utime = 1'000'000 + i * 1'000 + i * 7'919 % 90'000;
    events.emplace_back(utime, log.size());
    AppendEvent(log, {.number = i, .utime = utime, .channel = "A", .data = {}});
  }
  for (std::int64_t utime = 1'000'000; utime < 6'000'000; utime += 9'973) {
    const auto first = std::ranges::find_if(events, [&](const auto& event) { return event.first >= utime; });
    EXPECT_EQ(SeekTime(log, utime), first->second) << utime;
  }
}

TEST(SeekTime, FindsItsWayAroundDamage) {
  ScriptedLog log;
  for (int i = 0; i < 1'000; ++i) log.Add("CHANNEL", std::string(40, 'x'));
  std::vector<std::uint8_t> bytes = log.bytes();
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(log.offsets()[300]),
            bytes.begin() + static_cast<std::ptrdiff_t>(log.offsets()[700]), std::uint8_t{0});
  EXPECT_EQ(SeekTime(bytes, ScriptedLog::kStart + 100'000), log.offsets()[100]);
  EXPECT_EQ(SeekTime(bytes, ScriptedLog::kStart + 500'000), log.offsets()[700]);
  EXPECT_EQ(SeekTime(bytes, ScriptedLog::kStart + 900'000), log.offsets()[900]);
}

TEST(LogTail, OfAnEmptyLogIsItsBeginning) {
  const LogTail tail = FindTail({});
  EXPECT_EQ(tail.size, 0U);
  EXPECT_EQ(tail.next_number, 0);
  EXPECT_EQ(tail.open.seal(), LogSeal{});
}

TEST(LogTail, OfALogThatIsCutAnywhereIsItsLastWholeRecord) {
  ScriptedLog log;
  log.Add("A", "one").Add("B", "two").Add("A", "three");
  for (std::size_t size = 0; size <= log.bytes().size(); ++size) {
    std::size_t whole = 0;
    while (whole < 3 && log.end(whole) <= size) ++whole;
    const LogTail tail = FindTail(Bytes(log.bytes()).first(size));
    EXPECT_EQ(tail.size, whole == 0 ? 0 : log.end(whole - 1)) << size;
    EXPECT_EQ(tail.torn, size - tail.size);
    EXPECT_EQ(tail.next_number, static_cast<std::int64_t>(whole)) << size;
    EXPECT_EQ(tail.open.seal().crc32c, Crc32c(0, Bytes(log.bytes()).first(tail.size))) << size;
  }
}

TEST(LogTail, TellsWhatTheNextSealHasToCover) {
  ScriptedLog log;
  log.Add("A", "one").Add(kSealChannel, EncodeSeal({})).Add("A", "two").Add("A", "three");
  const LogTail tail = FindTail(log.bytes());
  const Bytes open = Bytes(log.bytes()).subspan(log.offsets()[2]);
  EXPECT_EQ(tail.open.seal(), (LogSeal{.bytes = open.size(), .events = 2, .crc32c = Crc32c(0, open)}));
}

TEST(LogTail, DamageBeforeTheEndIsNotItsConcern) {
  ScriptedLog log;
  log.Add("A", "one").Add("B", "two").Add("A", "three");
  std::vector<std::uint8_t> bytes = log.bytes();
  bytes[log.offsets()[1]] = 0;
  EXPECT_EQ(FindTail(bytes).size, bytes.size());
}

TEST(LogTail, OnlyTheEndIsReadWhereASealStandsThere) {
  for (const bool sealed : {true, false}) {
    ScriptedLog log;
    for (int i = 0; i < 100; ++i) log.Add("CHANNEL", "some data");
    if (sealed) log.Add(kSealChannel, EncodeSeal({}));
    log.Add("LAST", "x");
    for (const std::size_t look : {std::size_t{300}, std::size_t{1'000}, log.bytes().size()}) {
      std::vector<std::uint8_t> bytes = log.bytes();
      bytes[log.offsets()[1]] = 0;  // the counts show which part was read
      const LogTail tail = FindTail(bytes, look);
      EXPECT_EQ(tail.size, bytes.size());
      EXPECT_EQ(tail.next_number, sealed ? 102 : 101);
      EXPECT_EQ(tail.open.seal().events, sealed ? 1U : 100U);
    }
  }
}

}  // namespace
}  // namespace axlecast
