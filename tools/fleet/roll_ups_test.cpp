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

using testing::ElementsAreArray;
using testing::IsEmpty;
using testing::SizeIs;

TEST(RollUps, ASecondIsOneRowInSeveralBatches) {
  ComposerFixture log;
  for (std::int64_t i = 0; i < 100; ++i) log.Add("POSITION/axis1", PositionAt(i));
  EXPECT_THAT(log.Take().seconds, IsEmpty());
  for (std::int64_t i = 100; i < 300; ++i) log.Add("POSITION/axis1", PositionAt(i));
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.seconds, SizeIs(1));
  EXPECT_EQ(rows.seconds[0].summary.n, 250);
  EXPECT_EQ(rows.seconds[0].t, kT0);
  EXPECT_THAT(rows.minutes, IsEmpty());
}

TEST(RollUps, AnotherStreamHasItsOwnSecond) {
  ComposerFixture log;
  for (std::int64_t i = 0; i < 20; ++i) {
    position_t position = PositionAt(i);
    position.datum_epoch = i < 10 ? 0 : 1;
    log.Add("POSITION/axis1", position);
  }
  const BatchRows rows = log.TakeLast();
  ASSERT_THAT(rows.seconds, SizeIs(2));
  EXPECT_EQ(rows.seconds[0].summary.n, 10);
  EXPECT_EQ(rows.streams[rows.seconds[1].stream].datum_epoch, 1);
  EXPECT_THAT(rows.minutes, SizeIs(2));
}

TEST(RollUps, ASecondAndAMinuteAreOneRowEachOfABatch) {
  ComposerFixture log;
  for (std::int64_t i = 100; i < 100 + 25 * 250; ++i) {  // three periods of reception, which begin within a second
    position_t position = PositionAt(i);
    if (i % 2 == 0) position.flags = 0;
    log.Add("POSITION/axis1", position);
  }
  const BatchRows batch = log.TakeLast();
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

// What becomes of a log of two axes, of which one is silent for a while, if the reader restarts behind the events `stops`: seconds,
// minutes and runs of numbers, each as text.
struct Outcome {
  std::vector<std::string> seconds;
  std::map<std::string, std::int64_t> minutes;  // number of samples: the database joins the rows of several batches
  std::vector<std::string> received;

  void Add(const BatchRows& rows) {
    for (const RollUpRow& row : rows.seconds) seconds.push_back(TextOf(rows, row.stream, row.t, row.summary));
    for (const RollUpRow& row : rows.minutes) {
      minutes[rows.streams[row.stream].device + ' ' + std::to_string(row.t)] += row.summary.n;
    }
    for (const ReceivedRun& run : rows.received) {
      received.push_back(run.channel + ' ' + std::to_string(run.first_seq) + ' ' + std::to_string(run.last_seq));
    }
  }

 private:
  static std::string TextOf(const BatchRows& rows, std::size_t stream, std::int64_t t,
                            const SampleSummary& summary) {
    return rows.streams[stream].device + ' ' + std::to_string(t) + ' ' + std::to_string(summary.n) + ' ' +
           std::to_string(summary.lo.value_or(0)) + ' ' + std::to_string(summary.mean.value_or(0));
  }
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
  composer.EndLog();
  outcome.Add(composer.Take());
  for (auto* rows : {&outcome.seconds, &outcome.received}) std::sort(rows->begin(), rows->end());
  return outcome;
}

TEST(RollUps, ARestartChangesNoSecondMinuteOrRun) {
  const std::vector<Event> events = LogOfTwoAxes();
  const Outcome expected = Read(events, {});
  ASSERT_THAT(expected.seconds.size(), testing::Ge(40U));
  std::mt19937 random(1);
  for (int run = 0; run < 20; ++run) {
    std::vector<std::size_t> stops;
    for (int i = 0; i < 4; ++i) stops.push_back(1 + random() % (events.size() - 1));
    std::sort(stops.begin(), stops.end());
    const Outcome outcome = Read(events, stops);
    EXPECT_THAT(outcome.seconds, ElementsAreArray(expected.seconds));
    EXPECT_EQ(outcome.minutes, expected.minutes);
    EXPECT_THAT(outcome.received, ElementsAreArray(expected.received));
  }
}

TEST(RollUps, TheEndOfTheLogBeforeIsNotCountedAgain) {
  RowComposer composer(PressFacts(), "all", {}, kThisYear);
  const std::vector<Event> events = LogOfTwoAxes();
  for (std::size_t i = 0; i < 100; ++i) GiveTo(composer, events[i], true);
  composer.PrimeEndOfLog();
  composer.EndLog();
  const BatchRows rows = composer.Take();
  EXPECT_THAT(rows.seconds, IsEmpty());
  EXPECT_THAT(rows.minutes, IsEmpty());
  EXPECT_THAT(rows.received, IsEmpty());
}

}  // namespace
}  // namespace axlecast
