#include "drivers/tsubaki_sc/trips.h"

#include <gmock/gmock.h>
#include <axlecast/command_status_t.hpp>
#include <cmath>

#include "drivers/tsubaki_sc/device_test_support.h"

namespace axlecast::tsubaki_sc {
namespace {

TripStatus Status(int count, int log1 = 0, int log2 = 0, int log3 = 0) {
  return {.count = count, .motor = log1, .factors = {log1, log2, log3}};
}

TEST(TripsBetween, CountsWhatHappenedAlsoWhenTheCountWasCleared) {
  EXPECT_EQ(TripsBetween(Status(3, 1), Status(3, 1)), 0);
  EXPECT_EQ(TripsBetween(Status(3, 1), Status(4, 2, 1)), 1);
  EXPECT_EQ(TripsBetween(Status(3, 1), Status(6, 2, 2, 2)), 3);
  EXPECT_EQ(TripsBetween(Status(3, 1), Status(0, 1)), 0) << "cleared";
  EXPECT_EQ(TripsBetween(Status(3, 1), Status(1, 2, 1)), 1) << "cleared, then a trip";
  EXPECT_EQ(TripsBetween(Status(1, 1), Status(1, 2, 1)), 1) << "cleared, then a trip: the count is the same";
}

// ---- on a bench, with its unit ----

// Every sample of the newest log holds `mark`.
void ExpectMark(const TripRecord& trip, int mark) {
  const float divisors[] = {10, 1000, 10, 10, 100, 100, 100};  // guideline 10: 0.1 V, mA, 0.1 W, 0.1 C, 0.01 m/s2
  for (std::size_t q = 0; q < 7; ++q) {
    for (const float sample : trip.samples[q]) EXPECT_FLOAT_EQ(sample, static_cast<float>(mark) / divisors[q]) << q;
  }
}

TEST(TripReader, FetchesANewTripByItselfWithLiveDataSuspended) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.unit.Trip(0x08, 123);
  bench.RunUntil([&] { return !bench.output.motors.empty() && bench.output.motors.back().trip_count == 1; });
  const MonoNs published = bench.now;
  bench.sent.clear();
  bench.RunUntil([&] { return !bench.output.trips.empty(); });
  EXPECT_LE(bench.now - kCommandPause - published, 1'450 * kMillisecond);
  EXPECT_EQ(bench.sent.size(), 8U) << "seven curves, and the status again";
  EXPECT_EQ(bench.Count({0x04, 0x00, 0x64}), 0);
  const TripRecord& trip = bench.output.trips[0];
  EXPECT_EQ(trip.log_index, 1);
  EXPECT_EQ(trip.trip_count, 1);
  EXPECT_EQ(trip.factor_bits, 0x08);
  EXPECT_EQ(trip.interval_us, 200'000);
  EXPECT_EQ(trip.valid_mask, 0x7F);
  EXPECT_GT(trip.not_before, 0);
  EXPECT_LT(trip.not_before, trip.not_after);
  ExpectMark(trip, 123);
}

// Guideline 10, note 2: xx00 is 19 times the log acquisition time before the trip, xx19 the trip. Every register of the
// log holds another value.
TEST(TripReader, SampleNineteenIsTheTripAndSampleZeroTheOldest) {
  DeviceFixture bench;
  bench.unit.holdings[54] = 7;  // 0.7 s
  bench.GoOnline();
  bench.unit.Trip(0x08, 0);
  const auto value = [](std::size_t quantity, std::size_t sample) {
    return static_cast<std::uint16_t>(1'000 * quantity + 10 * sample + 1);
  };
  for (unsigned q = 0; q < 7; ++q) {
    for (unsigned i = 0; i < 20; ++i) bench.unit.inputs[1000 + 100 * q + i] = value(q, i);
  }
  bench.RunUntil([&] { return !bench.output.trips.empty(); });
  const TripRecord& trip = bench.output.trips[0];
  EXPECT_EQ(trip.interval_us, 700'000);
  const float divisors[] = {10, 1000, 10, 10, 100, 100, 100};  // guideline 10: 0.1 V, mA, 0.1 W, 0.1 C, 0.01 m/s2
  for (std::size_t q = 0; q < 7; ++q) {
    ASSERT_EQ(trip.samples[q].size(), 20U);
    for (std::size_t i = 0; i < 20; ++i) {
      EXPECT_FLOAT_EQ(trip.samples[q][i], static_cast<float>(value(q, i)) / divisors[q]) << q << ' ' << i;
    }
  }
}

TEST(TripReader, AlternatesWithLiveDataWhereTheConfigurationSaysSo) {
  DeviceFixture bench("{address: 1, trip_fetch: alternate}");
  bench.GoOnline();
  bench.unit.Trip(0x08, 123);
  bench.RunUntil([&] { return !bench.output.motors.empty() && bench.output.motors.back().trip_count == 1; });
  const MonoNs published = bench.now;
  bench.sent.clear();
  bench.RunUntil([&] { return !bench.output.trips.empty(); });
  EXPECT_LE(bench.now - kCommandPause - published, 2'600 * kMillisecond);
  EXPECT_GE(bench.Count({0x04, 0x00, 0x64}) + bench.Count({0x04, 0x00, 0xC8}), 7);
  ExpectMark(bench.output.trips[0], 123);
}

TEST(TripReader, WhatIsRecordedAtTheStartIsHistory) {
  DeviceFixture bench;
  bench.unit.Trip(0x01, 11);
  bench.unit.Trip(0x02, 22);
  bench.unit.ClearTrip();
  bench.LinkUp();
  bench.RunUntil([&] { return bench.output.trips.size() == 2; }, 128 * 60);
  EXPECT_EQ(bench.output.trips[0].log_index, 1);
  EXPECT_EQ(bench.output.trips[0].trip_count, 2);
  EXPECT_EQ(bench.output.trips[0].not_before, 0) << "when is not known";
  ExpectMark(bench.output.trips[0], 22);
  EXPECT_EQ(bench.output.trips[1].log_index, 2);
  EXPECT_EQ(bench.output.trips[1].trip_count, 1);
  EXPECT_EQ(bench.output.trips[1].factor_bits, 0x01);
  ExpectMark(bench.output.trips[1], 11);
}

// Factors and logs stay when the count is cleared (guideline 8).
TEST(TripReader, WhatIsRecordedBeforeAClearIsHistoryToo) {
  DeviceFixture bench;
  bench.unit.Trip(0x01, 11);
  bench.unit.Trip(0x02, 22);
  bench.unit.ClearTrip();
  bench.unit.inputs[200] = 0;
  bench.LinkUp();
  bench.RunUntil([&] { return bench.output.trips.size() == 2; }, 128 * 60);
  EXPECT_EQ(bench.output.trips[0].factor_bits, 0x02);
  EXPECT_EQ(bench.output.trips[0].trip_count, 0) << "not known any more";
  ExpectMark(bench.output.trips[0], 22);
  EXPECT_EQ(bench.output.trips[1].factor_bits, 0x01);
  ExpectMark(bench.output.trips[1], 11);
}

// Wherever the next trip falls: the logs shift under the reader's hands.
TEST(TripReader, ASecondTripNeverMixesSamples) {
  for (int after = 0; after < 12; ++after) {
    SCOPED_TRACE(after);
    DeviceFixture bench;
    bench.GoOnline();
    bench.unit.Trip(0x01, 11);
    bench.Turns(after);
    bench.unit.Trip(0x02, 22);
    bench.RunUntil([&] { return bench.output.trips.size() == 2; });
    for (const TripRecord& trip : bench.output.trips) {
      EXPECT_EQ(trip.factor_bits, trip.trip_count);
      ExpectMark(trip, 11 * trip.trip_count);
    }
    bench.Turns(50);
    EXPECT_EQ(bench.output.trips.size(), 2U) << "each once";
  }
}

TEST(TripReader, TripsInAHurryLeaveTheLiveDataTheirTurns) {
  DeviceFixture bench;
  bench.GoOnline();
  for (int i = 1; i <= 40; ++i) {
    bench.unit.Trip(0x01, static_cast<std::uint16_t>(i));
    bench.Turns(5);
  }
  EXPECT_GE(bench.Count({0x04, 0x00, 0x64}), 40);
  bench.RunUntil([&] { return bench.output.trips.size() >= 3; });
  for (const TripRecord& trip : bench.output.trips) ExpectMark(trip, trip.trip_count);
}

TEST(TripReader, ACurveThatTheUnitRefusesIsLeftOut) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.wire = [&](const ByteList& request) {
    if (request[1] == 0x04 && TestUnit::Word(request, 2) == 1300) return WithCrc({1, 0x84, 0x02});
    return bench.unit.Answer(request);
  };
  bench.unit.Trip(0x01, 55);
  bench.RunUntil([&] { return !bench.output.trips.empty(); });
  EXPECT_EQ(bench.output.trips[0].valid_mask, 0x77);
  EXPECT_TRUE(std::isnan(bench.output.trips[0].samples[3][0]));
  EXPECT_FLOAT_EQ(bench.output.trips[0].samples[0][19], 5.5F);
}

TEST(TripReader, AnIntervalThatTheGuidelineDoesNotKnowIsUnknown) {
  DeviceFixture bench;
  bench.unit.holdings[54] = 37'008;
  bench.GoOnline();
  bench.unit.Trip(0x01, 55);
  bench.RunUntil([&] { return !bench.output.trips.empty(); });
  EXPECT_EQ(bench.output.trips[0].interval_us, 0);
  EXPECT_EQ(bench.output.trips[0].valid_mask, 0x7F);
}

// ---- fetch_trip_logs ----

TEST(FetchTripLogs, PublishesAllThatAreRecorded) {
  DeviceFixture bench;
  bench.GoOnline();
  EXPECT_EQ(bench.Do("fetch_trip_logs").state, CommandState::kSucceeded);
  EXPECT_EQ(bench.Last().text, "no trip is recorded");
  for (int i = 1; i <= 4; ++i) {
    bench.unit.Trip(static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(10 * i));
  }
  bench.RunUntil([&] { return bench.output.trips.size() == 3; });
  bench.output.trips.clear();
  const MonoNs begin = bench.now;
  EXPECT_EQ(bench.Do("fetch_trip_logs").state, CommandState::kSucceeded) << bench.Last().text;
  ASSERT_EQ(bench.output.trips.size(), 3U);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(bench.output.trips[static_cast<std::size_t>(i)].log_index, i + 1);
    ExpectMark(bench.output.trips[static_cast<std::size_t>(i)], 10 * (4 - i));
  }
  EXPECT_LT(bench.now - begin, 4'100 * kMillisecond) << "device facts: 3.48 s, and four times the status";
  ASSERT_EQ(bench.Last().changes.size(), 3U);
  EXPECT_EQ(bench.Last().changes[0].after, "0x04 power_lower_limit_a");
}

TEST(FetchTripLogs, FindsThemAlsoWhenTheCountWasCleared) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.Trip(0x40, 9);
  bench.unit.inputs[200] = 0;
  bench.GoOnline();
  EXPECT_EQ(bench.Do("fetch_trip_logs").state, CommandState::kSucceeded);
  ASSERT_EQ(bench.output.trips.size(), 1U);
  EXPECT_EQ(bench.output.trips[0].trip_count, 0) << "which it was is not known";
  EXPECT_EQ(bench.output.trips[0].factor_bits, 0x40);
}

// Between the turns of an order come live ones, which read the log as well: the one that completes it may be theirs.
TEST(FetchTripLogs, EndsWhenALiveTurnHasCompletedTheLog) {
  for (int period = 2; period <= 4; ++period) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.unit.Trip(0x40, 9);
    bench.RunUntil([&] { return !bench.output.trips.empty(); });
    bench.output.trips.clear();
    bench.Begin("fetch_trip_logs");
    for (int i = 0; i < 100 && !bench.Last().IsFinal(); ++i) bench.BusSlot(true, i % period != 0);
    EXPECT_EQ(bench.Last().state, CommandState::kSucceeded) << period << ": " << bench.Last().text;
    EXPECT_EQ(bench.output.trips.size(), 1U) << period;
  }
}

TEST(FetchTripLogs, EndsWhenTheUnitRefusesItsStatus) {
  DeviceFixture bench;
  bench.unit.Trip(0x40, 9);
  bench.GoOnline();
  bench.Begin("fetch_trip_logs");
  bench.Turns(3);
  bench.wire = [&](const ByteList& request) {
    constexpr std::uint8_t kStatusAddress = 200;
    const bool status = request[1] == 0x04 && request[2] == 0 && request[3] == kStatusAddress;
    return status ? ByteList{0x01, 0x84, 0x02, 0xC2, 0xC1} : bench.unit.Answer(request);  // illegal data address
  };
  bench.RunUntil([&] { return bench.Last().IsFinal(); });
  EXPECT_EQ(bench.Last().state, CommandState::kFailed) << bench.Last().text;
}

TEST(FetchTripLogs, EndsWhenTheUnitIsGone) {
  DeviceFixture bench;
  bench.unit.Trip(0x40, 9);
  bench.GoOnline();
  bench.Begin("fetch_trip_logs");
  bench.Turns(3);
  bench.wire = [](const ByteList&) { return ByteList(); };
  bench.RunUntil([&] { return bench.Last().IsFinal(); });
  EXPECT_EQ(bench.Last().state, CommandState::kFailed);
  EXPECT_EQ(bench.Last().reason, command_status_t::REASON_NO_REPLY);
}

}  // namespace

}  // namespace axlecast::tsubaki_sc
