// The judge itself, without guests: it accepts intervals that hold the truth, and finds each that does not.
#include "tests/time_guests/judge.h"

#include <gtest/gtest.h>

#include <utility>

#include "tests/time_guests/claim_of_test.h"

namespace axlecast {
namespace {

using Q = time_quality_t;

constexpr CpuTicks kPerMillisecond = 2'000'000;  // a counter of 2 GHz

// What the clocks of the run show at a time of the test, in ns. The counter of each guest is the host's plus a constant.
MonoNs HostMono(MonoNs time) { return 100 * kSecond + time; }
MonoNs Mono(const Guest& guest, MonoNs time) { return guest.clock_id * kSecond + time + time / 20'000; }
MonoNs Raw(const Guest& guest, MonoNs time) { return 7 * guest.clock_id * kSecond + time; }
// UNIX time of b is 40 us ahead.
MonoNs Utc(const Guest& guest, MonoNs time) {
  return 1'000 * kSecond + time + (guest.host == "b" ? 40 * kMicrosecond : 0);
}

ClockReading ReadingAt(const Guest& guest, MonoNs time) {
  const CpuTicks ticks = 2 * time + guest.ticks_ahead.lowest;
  return {ticks - 100, Mono(guest, time), Raw(guest, time), Utc(guest, time), ticks + 100};
}

// 10 s of two guests: a is the root. Each receives a message of each, 10 times a second, 2 ms later.
class JudgeTest : public ::testing::Test {
 protected:
  JudgeTest() {
    for (MonoNs time = 0; time < 10 * kSecond; time += 10 * kMillisecond) {
      run_.host.Add({2 * time - 100, HostMono(time), HostMono(time), 0, 2 * time + 100});
    }
    AddGuest("a", 3, kBase);
    AddGuest("b", 4, 0);
    for (MonoNs time = kSecond; time < 9 * kSecond; time += 100 * kMillisecond) {
      for (const Guest& of : {run_.guests[0], run_.guests[1]}) {
        const time_quality_t claim = Claim(of, time);
        for (Guest& at : run_.guests) at.messages.push_back({Mono(at, time + 2 * kMillisecond), claim});
      }
    }
    Add(0, TestEvent::Kind::kPhase, "all");
  }

  void AddGuest(const char* host, std::int64_t clock_id, std::int64_t own_base_id) {
    Guest guest;
    guest.host = host;
    guest.clock_id = clock_id;
    guest.own_base_id = own_base_id;
    guest.ticks_ahead = {-1'000 * kPerMillisecond * clock_id, -1'000 * kPerMillisecond * clock_id + 200};
    for (MonoNs time = 0; time < 10 * kSecond; time += 10 * kMillisecond) guest.clocks.Add(ReadingAt(guest, time));
    run_.guests.push_back(std::move(guest));
  }

  [[nodiscard]] time_quality_t Claim(const Guest& of, MonoNs time) const {
    return ClaimOf(of, Mono(of, time), Raw(run_.guests[0], time));
  }

  void Add(MonoNs time, TestEvent::Kind kind, const char* text = "") {
    run_.events.push_back({HostMono(time), kind, text});
  }
  [[nodiscard]] std::vector<PhaseFigures> Judged(double shift = 0) const {
    return JudgeRun(run_, {.shift = shift});
  }

  GuestRun run_;
};

TEST_F(JudgeTest, AcceptsIntervalsThatHoldTheTruth) {
  const auto phases = Judged();
  ASSERT_EQ(phases.size(), 1U);
  EXPECT_EQ(phases[0].claims.holds, 80);
  EXPECT_EQ(phases[0].own.holds, 80);
  EXPECT_GT(phases[0].instants.holds, 400);
  EXPECT_GT(phases[0].comparisons.right, 50);
  EXPECT_GT(phases[0].comparisons.unknown, 50);
  EXPECT_LT(phases[0].oracle_error, 1'000);
  EXPECT_TRUE(IsTrue(phases));
}

// The truth is beside the middle, so that it is lost in one direction, and by a little more in the other.
TEST_F(JudgeTest, FindsIntervalsThatAreMovedByTheirHalfWidth) {
  const auto after = Judged(1);
  EXPECT_EQ(after[0].claims.misses, 80);
  EXPECT_GT(after[0].instants.misses, 100);
  EXPECT_FALSE(IsTrue(after));
  EXPECT_EQ(Judged(-1)[0].claims.misses, 0);
  EXPECT_EQ(Judged(-1.5)[0].claims.misses, 80);
}

TEST_F(JudgeTest, FindsOneIntervalThatMissesTheTruth) {
  run_.guests[1].messages[41].time.base_ns += kHalfWidth;
  EXPECT_EQ(Judged()[0].claims.misses, 1);
  EXPECT_FALSE(IsTrue(Judged()));
}

TEST_F(JudgeTest, FindsAWrongClaimOfTheRoot) {
  run_.guests[0].messages[40].time.base_ns += 5'000;
  EXPECT_EQ(Judged()[0].own.misses, 1);
  EXPECT_FALSE(IsTrue(Judged()));
}

TEST_F(JudgeTest, FindsInstantsThatAreComparedInTheWrongOrder) {
  EXPECT_EQ(Judged()[0].comparisons.wrong, 0);
  EXPECT_GT(Judged(3)[0].comparisons.wrong, 10);
  Comparisons comparisons;
  comparisons.Count(true, {5, 6}, {3, 4});
  comparisons.Count(true, {3, 4}, {5, 6});
  comparisons.Count(true, {3, 5}, {5, 6});
  comparisons.Count(false, {3, 4}, {5, 6});
  EXPECT_EQ(comparisons.wrong, 1);
  EXPECT_EQ(comparisons.right, 1);
  EXPECT_EQ(comparisons.undecided, 1);
  EXPECT_EQ(comparisons.unknown, 1);
}

TEST_F(JudgeTest, FindsClaimsThatOutliveTheirCause) {
  Add(3 * kSecond, TestEvent::Kind::kWithdraw);
  Add(5'950 * kMillisecond, TestEvent::Kind::kResume);
  // Those of 5.1 to 5.9 s.
  EXPECT_EQ(Judged()[0].late, 9);
  EXPECT_NEAR(static_cast<double>(Judged()[0].last), 2.9e9, 1e3);
  EXPECT_FALSE(IsTrue(Judged()));
  for (Guest::Message& message : run_.guests[1].messages) {
    const MonoNs mono = message.time.mono_ns;
    if (mono > Mono(run_.guests[1], 4 * kSecond) && mono < Mono(run_.guests[1], 6 * kSecond))
      message.time.half_width_ns = -1;
  }
  EXPECT_TRUE(IsTrue(Judged()));
}

TEST_F(JudgeTest, CountsApartWhatMayBeFalse) {
  Add(5 * kSecond, TestEvent::Kind::kBeyond);
  Add(9 * kSecond, TestEvent::Kind::kWithin);
  run_.guests[1].messages[101].time.base_ns += 2 * kHalfWidth;  // at 6 s
  const auto phases = Judged();
  EXPECT_GT(phases[0].beyond.misses, 0);
  EXPECT_TRUE(IsTrue(phases));
}

TEST_F(JudgeTest, SeparatesThePhases) {
  Add(4 * kSecond, TestEvent::Kind::kPhase, "second");
  run_.guests[1].messages[101].time.base_ns += 2 * kHalfWidth;
  const auto phases = Judged();
  ASSERT_EQ(phases.size(), 2U);
  EXPECT_EQ(phases[0].claims.misses, 0);
  EXPECT_EQ(phases[1].claims.misses, 1);
  Add(8 * kSecond, TestEvent::Kind::kPhase, "all");
  const auto again = Judged();
  ASSERT_EQ(again.size(), 2U);
  EXPECT_GT(again[0].claims.holds, phases[0].claims.holds);
}

TEST_F(JudgeTest, JudgesNothingOfAnUnknownBase) {
  for (Guest::Message& message : run_.guests[1].messages) message.time.base_id = 5;
  EXPECT_EQ(Judged()[0].claims.unjudged, 80);
}

// Lines that chronyc 4.3 printed in a guest: 72.430 us of correction, 1,016.416 us of dispersion, 1,030.665 us of delay.
TEST_F(JudgeTest, ComparesWhatChronydClaimsWithTheTruth) {
  const auto claim = ParseTracking(
      "30.46,0A000001,10.0.0.1,2,1795690759.693363742,0.000072430,-0.000156311,0.000332381,94.949,-18.744,615.504,"
      "0.001030665,0.001016416,0.3,Normal");
  ASSERT_TRUE(claim);
  EXPECT_EQ(claim->mono, 30'460 * kMillisecond);
  EXPECT_NEAR(static_cast<double>(claim->half_width), 1'604'178.5, 1);
  EXPECT_FALSE(ParseTracking(
      "28.29,00000000,,0,0.000000000,0.000000000,0.000000000,0.000000000,0.000,0.000,0.000,1.000000000,1.000000000,"
      "0.0,Not synchronised"));
  EXPECT_FALSE(ParseTracking("506 Cannot talk to daemon"));
  Guest& guest = run_.guests[1];
  guest.utc_claims = {{Mono(guest, 3 * kSecond), 41 * kMicrosecond}, {Mono(guest, 4 * kSecond), 39 * kMicrosecond}};
  const auto phases = Judged();
  EXPECT_EQ(phases[0].utc.holds, 1);
  EXPECT_EQ(phases[0].utc.misses, 1);
  EXPECT_TRUE(IsTrue(phases));
}

TEST_F(JudgeTest, ComparesTheUnixTimeOfTimeMessagesWithTheTruth) {
  Guest& guest = run_.guests[1];
  for (const std::size_t message : {41U, 43U}) {
    time_quality_t& time = guest.messages[message].time;
    time.utc_ns = Utc(guest, (time.mono_ns - 4 * kSecond) * 20'000 / 20'001);
    time.utc_half_width_ns = message == 41 ? 41 * kMicrosecond : 39 * kMicrosecond;
    time.utc_grade = Q::GRADE_CLAIMED;
  }
  const auto phases = Judged();
  EXPECT_EQ(phases[0].utc_published.holds, 1);
  EXPECT_EQ(phases[0].utc_published.misses, 1);
  EXPECT_TRUE(IsTrue(phases));
}

}  // namespace
}  // namespace axlecast
