// The judge of ticks itself, without guests: it accepts sets that hold the truth, and finds each that does not.
#include "tests/time_guests/tick_judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "tests/time_guests/claim_of_test.h"

namespace axlecast {
namespace {

using ::testing::Each;
using ::testing::Field;
using ::testing::SizeIs;

constexpr std::int64_t kCountsPerTurn = 1 << 17;
constexpr double kRpm = 3'000;
constexpr MonoNs kPeriod = 50 * kMillisecond;
constexpr MonoNs kUncertainty = 300 * kMicrosecond;

// The clocks of the run at a time of the test, in ns. The counter of each guest is the host's, which is two ticks a ns, plus a constant.
MonoNs HostMono(MonoNs time) { return 100 * kSecond + time; }
MonoNs Mono(const Guest& guest, MonoNs time) { return guest.clock_id * kSecond + time; }
MonoNs Raw(const Guest& guest, MonoNs time) { return 7 * guest.clock_id * kSecond + time; }
double TurnsAt(MonoNs time) { return static_cast<double>(time) * kRpm / 60e9; }

// 10 s of two guests: a is the root. Of each tick, x of a is sampled 100 us before it, and v of b 100 us after it.
class TickJudgeTest : public ::testing::Test {
 protected:
  TickJudgeTest() {
    for (MonoNs time = 0; time < 10 * kSecond; time += 10 * kMillisecond) {
      run_.host.Add({2 * time - 100, HostMono(time), HostMono(time), 0, 2 * time + 100});
    }
    Begin(0, "all");
    AddGuest("a", 3, kBase, "x");
    AddGuest("b", 4, 0, "v");
    for (MonoNs time = 50 * kMillisecond; time < 9 * kSecond; time += kPeriod) {
      for (const Guest& of : {run_.guests[0], run_.guests[1]}) {
        const time_quality_t claim = Claim(of, time - 10 * kMillisecond);
        for (Guest& at : run_.guests) at.messages.push_back({Mono(at, time - 9 * kMillisecond), claim});
      }
      for (Guest& at : run_.guests) {
        const MonoNs received = Mono(at, time + kMillisecond);
        at.positions.push_back({received, "x", Position(run_.guests[0], time, -100 * kMicrosecond)});
        at.positions.push_back({received, "v", Position(run_.guests[1], time, 100 * kMicrosecond)});
      }
      run_.guests[0].sets.push_back({Mono(run_.guests[0], time + kMillisecond), Set(time)});
    }
  }

  void Begin(MonoNs time, const char* phase) {
    run_.events.push_back({HostMono(time), TestEvent::Kind::kPhase, phase});
  }

  void AddGuest(const char* host, std::int64_t clock_id, std::int64_t own_base_id, const char* axis) {
    Guest guest;
    guest.name = guest.host = host;
    guest.clock_id = clock_id;
    guest.own_base_id = own_base_id;
    const CpuTicks ahead = -1'000'000'000 * clock_id;
    guest.ticks_ahead = {ahead, ahead + 200};
    for (MonoNs time = 0; time < 10 * kSecond; time += 10 * kMillisecond) {
      guest.clocks.Add({2 * time + ahead - 100, Mono(guest, time), Raw(guest, time), 0, 2 * time + ahead + 100});
    }
    for (const MonoNs time : {kSecond, 8 * kSecond})
      guest.shafts[axis].Add({Mono(guest, time), TurnsAt(time), kRpm});
    run_.guests.push_back(std::move(guest));
  }

  [[nodiscard]] time_quality_t Claim(const Guest& of, MonoNs time) const {
    return ClaimOf(of, Mono(of, time), Raw(run_.guests[0], time));
  }

  // Sampled `later` than the tick; the middle of the interval is 50 us earlier.
  [[nodiscard]] static position_t Position(const Guest& of, MonoNs tick, MonoNs later) {
    position_t position{};
    position.clock_id = of.clock_id;
    position.mono_ns = Mono(of, tick + later - 50 * kMicrosecond);
    position.time_uncertainty_ns = kUncertainty;
    position.tick = tick / kPeriod;
    position.counts = std::llround(TurnsAt(tick + later) * kCountsPerTurn);
    position.counts_per_turn = kCountsPerTurn;
    position.flags = position_t::FLAG_VALID;
    return position;
  }

  [[nodiscard]] position_set_t Set(MonoNs tick) const {
    position_set_t set{};
    set.set = "gantry";
    set.period_ns = kPeriod;
    set.tick = tick / kPeriod;
    set.tick_ns = Raw(run_.guests[0], tick);
    set.base_id = kBase;
    set.limit_ns = kMillisecond;
    set.state = position_set_t::STATE_NOT_ALIGNED;
    for (const MonoNs later : {-100 * kMicrosecond, 100 * kMicrosecond}) {
      position_set_axis_t axis{};
      axis.device = later < 0 ? "x" : "v";
      axis.offset_ns = static_cast<std::int32_t>(later - 50 * kMicrosecond);
      axis.half_width_ns = kUncertainty;
      axis.counts = std::llround(TurnsAt(tick + later) * kCountsPerTurn);
      set.axes.push_back(axis);
    }
    set.n = 2;
    set.earliest_ns = set.tick_ns - 450 * kMicrosecond;
    set.latest_ns = set.tick_ns + 350 * kMicrosecond;
    return set;
  }

  [[nodiscard]] std::vector<TickFigures> Judged(double shift = 0) const { return JudgeTicks(run_, shift); }
  // The set of the tick at 4 s.
  [[nodiscard]] position_set_t& AtFour() { return run_.guests[0].sets[79].set; }

  GuestRun run_;
};

TEST_F(TickJudgeTest, AcceptsSetsThatHoldTheTruth) {
  const auto all = Judged();
  ASSERT_THAT(all, SizeIs(3)) << "published, and made in both guests";
  for (const TickFigures& each : all) {
    SCOPED_TRACE(each.maker);
    EXPECT_NEAR(static_cast<double>(each.ticks), 179, 1);
    EXPECT_EQ(each.incomplete, 0);
    ASSERT_NEAR(static_cast<double>(each.judged.holds), 139, 1) << "between the looks at the shafts";
    EXPECT_EQ(each.judged.misses + each.judged.undecided, 0);
    EXPECT_NEAR(static_cast<double>(each.spreads[50]), 200e3, 500);
    EXPECT_LT(each.oracle_error, 2'000);
  }
  EXPECT_EQ(all[0].hulls[50], 800'000);
  EXPECT_GT(all[1].hulls[50], 2'000'000) << "with the half width of the claims";
  EXPECT_TRUE(IsTrue(all, 100));
  EXPECT_FALSE(IsTrue(all, 200));
  EXPECT_FALSE(IsTrue({}, 0));
}

// The truth is 50 us later than the middle.
TEST_F(TickJudgeTest, FindsIntervalsThatAreMovedByTheirHalfWidth) {
  EXPECT_GT(Judged(-1)[0].judged.misses, 100);
  EXPECT_FALSE(IsTrue(Judged(-1), 0));
  EXPECT_EQ(Judged(1)[0].judged.misses, 0);
  for (const double shift : {-2.0, 2.0}) {
    EXPECT_THAT(Judged(shift), Each(Field(&TickFigures::judged, Field(&Verdicts::misses, ::testing::Gt(100)))));
  }
}

TEST_F(TickJudgeTest, FindsOneAxisThatWasSampledOutsideOfItsInterval) {
  AtFour().axes[1].half_width_ns = 49'000;
  EXPECT_EQ(Judged()[0].judged.misses, 1);
  EXPECT_FALSE(IsTrue(Judged(), 0));
}

TEST_F(TickJudgeTest, FindsAHullThatIsTooNarrow) {
  AtFour().latest_ns = AtFour().tick_ns + 99'000;
  EXPECT_EQ(Judged()[0].judged.misses, 1);
  EXPECT_FALSE(IsTrue(Judged(), 0));
}

TEST_F(TickJudgeTest, FindsOneCountThatIsOfAnotherTick) {
  AtFour().axes[0].counts += kCountsPerTurn / 10;
  EXPECT_EQ(Judged()[0].judged.misses, 1);
}

TEST_F(TickJudgeTest, FindsAWrongClaimOfTime) {
  for (Guest& guest : run_.guests) {
    for (Guest::Message& message : guest.messages) {
      if (message.time.host == "b") message.time.base_ns += 2 * kHalfWidth;
    }
  }
  const auto all = Judged();
  EXPECT_EQ(all[0].judged.misses, 0);
  EXPECT_GT(all[1].judged.misses, 100);
  EXPECT_GT(all[2].judged.misses, 100);
}

TEST_F(TickJudgeTest, SeparatesThePhases) {
  Begin(5 * kSecond, "second");
  AtFour().axes[1].half_width_ns = 49'000;
  const auto all = Judged();
  ASSERT_THAT(all, SizeIs(6));
  EXPECT_EQ(all[0].judged.misses, 1);
  EXPECT_EQ(all[1].phase, "second");
  EXPECT_EQ(all[1].judged.misses, 0);
  EXPECT_GT(all[1].judged.holds, 50);
  AtFour().axes[1].half_width_ns = kUncertainty;
  EXPECT_TRUE(IsTrue(Judged(), 100)) << "of both phases together";
}

TEST_F(TickJudgeTest, CountsIncompleteTicksApart) {
  AtFour().state = position_set_t::STATE_INCOMPLETE;
  const std::int64_t before = Judged()[1].judged.holds;
  EXPECT_EQ(Judged()[0].incomplete, 1);
  auto& positions = run_.guests[0].positions;
  positions.erase(positions.begin() + 159);  // v of the tick at 4 s
  EXPECT_EQ(Judged()[1].incomplete, 1);
  EXPECT_EQ(Judged()[1].judged.holds, before - 1);
}

TEST_F(TickJudgeTest, JudgesNothingOfAShaftThatDidNotTurnAtAConstantSpeed) {
  run_.guests[1].shafts["v"].Add({Mono(run_.guests[1], 9 * kSecond), TurnsAt(9 * kSecond) + 0.001, kRpm});
  EXPECT_EQ(Judged()[0].judged.unjudged, Judged()[0].ticks);
  EXPECT_FALSE(IsTrue(Judged(), 1));
}

TEST(ShaftLooks, BoundsTheInstantOfACount) {
  ShaftLooks looks;
  EXPECT_FALSE(looks.When(5, 100));
  looks.Add({1'000'000, 0, 60});  // a turn in 10^9 ns
  EXPECT_FALSE(looks.When(5, 100));
  looks.Add({2'001'000'000, 2, 60});
  const auto bounds = looks.When(5, 100);
  ASSERT_TRUE(bounds);
  EXPECT_NEAR(static_cast<double>(bounds->lowest), 51e6, 3);
  EXPECT_NEAR(static_cast<double>(bounds->highest), 61e6, 3);
  EXPECT_FALSE(looks.When(-1, 100)) << "before the first look";
  EXPECT_FALSE(looks.When(200, 100)) << "after the last one";
}

TEST(ShaftLooks, AreReadFromAFile) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "shafts";
  std::ofstream(path) << "x 1000000 720 60\ny 7 0 60\nx 2001000000 1440 60\n";
  const auto shafts = ReadShaftLooks(path);
  ASSERT_TRUE(shafts);
  EXPECT_THAT(*shafts, SizeIs(2));
  ASSERT_TRUE(shafts->at("x").When(250, 100));
  EXPECT_NEAR(static_cast<double>(shafts->at("x").When(250, 100)->lowest), 501e6, 3);
  std::ofstream(path) << "x 1000000 fast\n";
  EXPECT_FALSE(ReadShaftLooks(path));
  std::filesystem::remove(path);
  EXPECT_TRUE(ReadShaftLooks(path));
}

}  // namespace
}  // namespace axlecast
