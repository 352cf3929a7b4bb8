#include "tools/monitor/time_agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "core/config/load.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using Q = time_quality_t;

constexpr std::int64_t kUtc = 1'795'690'781 * std::int64_t{1'000'000'000};
constexpr MonoNs kBase = 5'000 * kSecond;
constexpr MonoNs kNow = 100 * kSecond;

// A host that claims the base within 100 us. Its UNIX clock is `ahead` of that of a host with 0.
Q Claim(const std::string& host, std::int64_t ahead = 0) {
  Q quality{};
  quality.host = host;
  quality.root = "plc1";
  quality.base_id = 7;
  quality.base_ns = kBase;
  quality.half_width_ns = 100'000;
  quality.growth_ppb = 1'100'000;
  quality.state = Q::STATE_SYNCHRONISED;
  quality.utc_ns = kUtc + ahead;
  quality.utime = quality.utc_ns / kMicrosecond;
  quality.utc_half_width_ns = -1;
  return quality;
}

Q FromChrony(Q quality, std::int64_t half_width_ns, const std::string& reference = "192.168.5.9") {
  quality.utc_half_width_ns = half_width_ns;
  quality.utc_grade = Q::GRADE_CLAIMED;
  quality.utc_source = Q::SOURCE_CHRONY;
  quality.utc_reference = reference;
  return quality;
}

class TimeAgreement : public ::testing::Test {
 protected:
  TimeAgreement() : view_(Config()) {}

  static MachineConfig Config() {
    ConfigErrors errors("m.yaml");
    const auto machine = ParseConfig(
        "machine: test\ntime: {root: plc1, address: 10.0.0.1}\nbuses: {b: {family: tformat, simulate: true, "
        "devices: "
        "{axis1: {model: ts5669n127}}}}\n",
        errors);
    EXPECT_TRUE(machine) << errors.Text();
    return machine ? *machine : MachineConfig{};
  }
  void On(const Q& quality) { view_.OnMessage("TIME/" + quality.host, Encoded(quality), kNow); }
  static std::vector<std::uint8_t> Encoded(const Q& quality) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(quality.getEncodedSize()));
    quality.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    return bytes;
  }

  MachineView view_;
};

TEST_F(TimeAgreement, ClocksWithinOneSecondAreNoFault) {
  On(Claim("plc1"));
  On(Claim("cell2", kSecond));
  On(Claim("cell3", -kSecond));
  EXPECT_THAT(UtcFaults(view_, kNow), IsEmpty()) << "1 s +- the width of the base";
}

TEST_F(TimeAgreement, AClockThatIsCertainlyOffByMoreIsNamedWithTheFigure) {
  On(Claim("plc1"));
  On(Claim("cell2", -kSecond - 300'000));
  const auto faults = UtcFaults(view_, kNow);
  EXPECT_THAT(
      faults,
      ElementsAre(StartsWith("UNIX time: the clock of cell2 is 1.000300 s +-0.000201 s behind that of plc1")));
  EXPECT_THAT(MachineFaults(view_, kNow), ::testing::Contains(faults.at(0)));
}

TEST_F(TimeAgreement, WithoutACommonBaseNothingIsStated) {
  Q other = Claim("cell2", 9 * kSecond);
  other.base_id = 8;
  On(Claim("plc1"));
  On(other);
  EXPECT_THAT(UtcFaults(view_, kNow), IsEmpty());
  On(Claim("cell2", 9 * kSecond));
  EXPECT_EQ(UtcFaults(view_, kNow).size(), 1U);
  EXPECT_THAT(UtcFaults(view_, kNow + 60 * kSecond), IsEmpty()) << "the messages are old";
}

TEST_F(TimeAgreement, AMessageOfAnEarlierVersionHasUnixTimeInMicroseconds) {
  Q old = Claim("cell2", 2 * kSecond);
  old.utc_ns = 0;
  On(Claim("plc1"));
  On(old);
  EXPECT_THAT(UtcFaults(view_, kNow), ElementsAre(StartsWith("UNIX time: the clock of cell2 is 2.000000 s")));
}

// The difference is within 1 ms +-201 us, and the claims grant 799 us or 798 us.
TEST_F(TimeAgreement, ClaimsFromOneServerMustBeCompatible) {
  const auto differ = Difference(Claim("cell2"), Claim("cell3", kMillisecond));
  ASSERT_TRUE(differ);
  EXPECT_EQ(differ->ns, -kMillisecond);
  const std::int64_t granted = kMillisecond - differ->width_ns;
  On(FromChrony(Claim("cell2"), granted / 2));
  On(FromChrony(Claim("cell3", kMillisecond), granted - granted / 2));
  EXPECT_THAT(UtcFaults(view_, kNow), IsEmpty());
  On(FromChrony(Claim("cell3", kMillisecond), granted - granted / 2 - 1));
  EXPECT_THAT(UtcFaults(view_, kNow),
              ElementsAre(StartsWith("UNIX time: cell2 and cell3 claim UTC from 192.168.5.9 within 0.")));
  On(FromChrony(Claim("cell3", kMillisecond), 1, "192.168.5.10"));
  EXPECT_THAT(UtcFaults(view_, kNow), IsEmpty()) << "two servers: nothing is known of their difference";
}

constexpr std::int64_t kRootClock = 11;
constexpr std::int64_t kOtherClock = 22;

class UnixTimesTest : public TimeAgreement {
 protected:
  void OnTime(Q quality, std::int64_t clock) {
    quality.clock_id = clock;
    On(quality);
    for (const HostView& host : view_.hosts()) {
      if (host.name == quality.host) times_.Update(view_, host, kNow);
    }
  }

  UnixTimes times_;
};

TEST_F(UnixTimesTest, AnInstantOfAnotherHostIsConvertedByTheBase) {
  constexpr std::int64_t kInstant = kUtc / kMicrosecond;
  EXPECT_EQ(times_.Convert(kInstant, kOtherClock, kRootClock), kInstant) << "nothing is known yet";
  OnTime(Claim("plc1"), kRootClock);
  OnTime(Claim("cell2", 3 * kSecond), kOtherClock);
  EXPECT_EQ(times_.Convert(kInstant, kOtherClock, kRootClock), kInstant - 3'000'000);
  EXPECT_EQ(times_.Convert(kInstant, kRootClock, kOtherClock), kInstant + 3'000'000);
  EXPECT_EQ(times_.Convert(kInstant, kOtherClock, kOtherClock), kInstant);
  EXPECT_EQ(times_.Convert(kInstant, 33, kRootClock), kInstant) << "a clock without a claim";
}

TEST_F(UnixTimesTest, ItChangesOnlyWhenTheClocksCertainlyDid) {
  constexpr std::int64_t kInstant = kUtc / kMicrosecond;
  OnTime(Claim("plc1"), kRootClock);
  OnTime(Claim("cell2", 3 * kSecond), kOtherClock);
  OnTime(Claim("cell2", 3 * kSecond + 150'000), kOtherClock);
  EXPECT_EQ(times_.Convert(kInstant, kOtherClock, kRootClock), kInstant - 3'000'000) << "within 200 us";
  OnTime(Claim("cell2", -kSecond), kOtherClock);
  EXPECT_EQ(times_.Convert(kInstant, kOtherClock, kRootClock), kInstant + 1'000'000) << "the clock was set";
}

TEST_F(UnixTimesTest, ImpossibleInstantsStayAsTheyAre) {
  OnTime(Claim("plc1"), kRootClock);
  OnTime(Claim("cell2", 3 * kSecond), kOtherClock);
  for (const std::int64_t instant :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(times_.Convert(instant, kOtherClock, kRootClock), instant);
    EXPECT_EQ(times_.Convert(instant, kRootClock, kOtherClock), instant);
  }
}

// Anybody can send such a message: no sum of its figures may overflow.
TEST_F(TimeAgreement, ImpossibleFiguresAreNotCompared) {
  for (const std::int64_t figure :
       {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1}, std::numeric_limits<std::int64_t>::max()}) {
    Q base = Claim("cell2");
    base.base_ns = figure;
    EXPECT_FALSE(Difference(base, Claim("plc1"))) << figure;
    Q utc = Claim("cell2");
    utc.utc_ns = figure;
    EXPECT_FALSE(Difference(Claim("plc1"), utc)) << figure;
    Q width = Claim("cell2");
    width.half_width_ns = figure;
    EXPECT_FALSE(Difference(width, Claim("plc1"))) << figure;
  }
  Q far = Claim("cell2");
  far.base_ns += 11 * kSecond;
  EXPECT_FALSE(Difference(far, Claim("plc1")));
  far = Claim("cell2");
  far.growth_ppb = std::numeric_limits<std::int32_t>::max();
  far.base_ns += 9 * kSecond;
  EXPECT_GT(Difference(far, Claim("plc1"))->width_ns, 19 * kSecond);
}

}  // namespace
}  // namespace axlecast
