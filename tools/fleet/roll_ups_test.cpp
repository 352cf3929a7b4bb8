#include "tools/fleet/roll_ups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "tools/fleet/row_fixture.h"

namespace axlecast {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

TEST(RollUps, EveryBatchHasAllOfItsSamples) {
  ComposerFixture log;
  for (std::int64_t i = 0; i < 100; ++i) log.Add("POSITION/axis1", PositionAt(i));
  BatchRows rows = log.Take();
  ASSERT_THAT(rows.seconds, SizeIs(1));
  EXPECT_EQ(rows.seconds[0].summary.n, 100);
  for (std::int64_t i = 100; i < 300; ++i) log.Add("POSITION/axis1", PositionAt(i));
  rows = log.Take();
  ASSERT_THAT(rows.seconds, SizeIs(2));
  EXPECT_EQ(rows.seconds[0].t, kT0);
  EXPECT_EQ(rows.seconds[0].summary.n, 150);
  EXPECT_EQ(rows.seconds[1].summary.n, 50);
  ASSERT_THAT(rows.minutes, SizeIs(1));
  EXPECT_EQ(rows.minutes[0].summary.n, 200);
  ASSERT_THAT(rows.received, SizeIs(1));
  EXPECT_EQ(rows.received[0].first_seq, 100);
  EXPECT_EQ(rows.received[0].last_seq, 299);
  rows = log.Take();
  EXPECT_THAT(rows.seconds, IsEmpty());
  EXPECT_THAT(rows.minutes, IsEmpty());
  EXPECT_THAT(rows.received, IsEmpty());
}

TEST(RollUps, AnotherStreamHasItsOwnSecond) {
  ComposerFixture log;
  for (std::int64_t i = 0; i < 20; ++i) {
    position_t position = PositionAt(i);
    position.datum_epoch = i < 10 ? 0 : 1;
    log.Add("POSITION/axis1", position);
  }
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.seconds, SizeIs(2));
  EXPECT_EQ(rows.seconds[0].summary.n, 10);
  EXPECT_EQ(rows.streams[rows.seconds[1].stream].datum_epoch, 1);
  EXPECT_THAT(rows.minutes, SizeIs(2));
}

TEST(RollUps, ASecondAndAMinuteAreOneRowEachOfABatch) {
  ComposerFixture log;
  for (std::int64_t i = 100; i < 100 + 25 * 250; ++i) {  // from a second's middle to another one's
    position_t position = PositionAt(i);
    if (i % 2 == 0) position.flags = 0;
    log.Add("POSITION/axis1", position);
  }
  const BatchRows batch = log.Take();
  EXPECT_THAT(batch.seconds, SizeIs(26));
  for (const auto* rows : {&batch.seconds, &batch.minutes}) {
    std::int64_t n = 0;
    double sum = 0;
    std::set<std::int64_t> times;
    for (const RollUpRow& row : *rows) {
      EXPECT_TRUE(times.insert(row.t).second);
      n += row.summary.n;
      sum += row.summary.mean.value() * static_cast<double>(row.summary.valid);
    }
    EXPECT_EQ(n, 6'250);
    EXPECT_NEAR(sum / 3'125, 1'000 + 100 * 3'225.0, 0.01);
  }
}

// What the database has of a log of two axes, of which one is silent for a while, if the reader restarts behind the events `stops`: numbers
// of samples by device and begin of seconds and minutes, and the numbers that were received.
struct Outcome {
  std::map<std::string, std::int64_t> seconds;
  std::map<std::string, std::int64_t> minutes;
  std::map<std::string, std::set<std::int64_t>> received;  // by channel
  std::int64_t received_twice = 0;

  void Add(const BatchRows& rows) {
    const auto add = [&rows](const std::vector<RollUpRow>& from, std::map<std::string, std::int64_t>& to) {
      for (const RollUpRow& row : from) {
        to[rows.streams[row.stream].device + ' ' + std::to_string(row.t)] += row.summary.n;
      }
    };
    add(rows.seconds, seconds);
    add(rows.minutes, minutes);
    for (const ReceivedRun& run : rows.received) {
      for (std::int64_t seq = run.first_seq; seq <= run.last_seq; ++seq) {
        if (!received[run.channel].insert(seq).second) ++received_twice;
      }
    }
  }
  friend bool operator==(const Outcome&, const Outcome&) = default;
};

struct Event {
  std::string channel;
  std::int64_t utime;
  std::vector<std::uint8_t> data;
};

std::vector<Event> LogOfTwoAxes() {
  std::vector<Event> events;
  for (std::int64_t i = 0; i < 40 * 250; ++i) {
    if (i % 997 == 5) continue;  // missing in the log
    const position_t position = PositionAt(i);
    events.push_back({"POSITION/axis1", position.utime + 300, Encoded(position)});
    const bool silent = i > 2'000 && i < 7'000;  // 20 s
    if (!silent && i % 25 == 0) {
      position_t other = PositionAt(i);
      other.seq = i / 25;
      events.push_back({"POSITION/axis2", other.utime + 400, Encoded(other)});
    }
  }
  return events;
}

void GiveTo(RowComposer& composer, const Event& event, bool prime) {
  const LogEvent record = {.number = 0, .utime = event.utime, .channel = event.channel, .data = event.data};
  prime ? composer.Prime(record) : composer.Add(record);
}

Outcome Read(const std::vector<Event>& events, const std::vector<std::size_t>& stops) {
  Outcome outcome;
  RowComposer composer(PressFacts(), "all", {}, kThisYear);
  for (std::size_t i = 0; i < events.size(); ++i) {
    if (std::binary_search(stops.begin(), stops.end(), i)) {
      outcome.Add(composer.Take());
      composer = RowComposer(PressFacts(), "all", {}, kThisYear);
      for (std::size_t j = 0; j < i; ++j) {
        if (events[j].utime >= events[i - 1].utime - RowComposer::kPrimeUs) GiveTo(composer, events[j], true);
      }
    }
    GiveTo(composer, events[i], false);
  }
  outcome.Add(composer.Take());
  return outcome;
}

TEST(RollUps, ARestartChangesNoSecondMinuteOrRun) {
  const std::vector<Event> events = LogOfTwoAxes();
  const Outcome expected = Read(events, {});
  ASSERT_THAT(expected.seconds.size(), testing::Ge(40U));
  EXPECT_EQ(expected.received_twice, 0);
  std::mt19937 random(1);
  for (int run = 0; run < 20; ++run) {
    std::vector<std::size_t> stops;
    for (int i = 0; i < 4; ++i) stops.push_back(1 + random() % (events.size() - 1));
    std::sort(stops.begin(), stops.end());
    EXPECT_EQ(Read(events, stops), expected);
  }
}

TEST(RollUps, WhatItIsPrimedWithIsNotCountedAgain) {
  RowComposer composer(PressFacts(), "all", {}, kThisYear);
  const std::vector<Event> events = LogOfTwoAxes();
  for (std::size_t i = 0; i < 100; ++i) GiveTo(composer, events[i], true);
  const BatchRows rows = composer.Take();
  EXPECT_THAT(rows.seconds, IsEmpty());
  EXPECT_THAT(rows.minutes, IsEmpty());
  EXPECT_THAT(rows.received, IsEmpty());
}

}  // namespace
}  // namespace axlecast
