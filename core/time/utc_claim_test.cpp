#include "core/time/utc_claim.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

using Q = time_quality_t;

constexpr std::int64_t kUtc = 1'795'690'781 * std::int64_t{1'000'000'000};

// 100 us of correction, 200 us of dispersion, 300 us of delay; 50 ppm + 2 ppm + 48 ppm of growth.
ChronyTracking Tracking() {
  return {.reference_id = 0x0A000001,
          .reference = "10.0.0.1",
          .stratum = 2,
          .leap = 0,
          .reference_utc_ns = kUtc,
          .correction_s = -100e-6,
          .residual_frequency_ppm = -2,
          .skew_ppm = 48,
          .root_delay_s = 300e-6,
          .root_dispersion_s = 200e-6};
}

TEST(UtcClaim, IsTheBoundOfTheManualAndGrows) {
  const UtcClaim now = ClaimOfChrony(Tracking(), kUtc);
  EXPECT_EQ(now.half_width_ns, 450'000);
  EXPECT_EQ(now.grade, Q::GRADE_CLAIMED);
  EXPECT_EQ(now.source, Q::SOURCE_CHRONY);
  EXPECT_EQ(now.reference, "10.0.0.1");
  EXPECT_NEAR(static_cast<double>(ClaimOfChrony(Tracking(), kUtc + 10 * kSecond).half_width_ns), 1'450'000, 1)
      << "10 s at 100 ppm";
  EXPECT_EQ(ClaimOfChrony(Tracking(), kUtc - kSecond).half_width_ns, 450'000) << "UNIX time was set back";
}

TEST(UtcClaim, WithoutAReferenceThereIsNone) {
  ChronyTracking tracking = Tracking();
  tracking.leap = ChronyTracking::kNotSynchronised;
  EXPECT_EQ(ClaimOfChrony(tracking, kUtc).half_width_ns, -1);
  EXPECT_EQ(ClaimOfChrony(tracking, kUtc).grade, Q::GRADE_NONE);
  tracking = Tracking();
  tracking.reference_id = ChronyTracking::kLocalReference;
  EXPECT_EQ(ClaimOfChrony(tracking, kUtc).half_width_ns, -1);
  EXPECT_EQ(ClaimOfChrony(tracking, kUtc).reference, "its own clock");
  tracking = Tracking();
  tracking.root_dispersion_s = 1e6;
  EXPECT_EQ(ClaimOfChrony(tracking, kUtc).half_width_ns, -1) << "more than eleven days: nothing is known";
}

TEST(UtcClaim, OfPtpIsTheFigureOfTheFileWhileTheClockIsKept) {
  const UtcClaim claim = ClaimOfPtp(250, true);
  EXPECT_EQ(claim.half_width_ns, 250'000);
  EXPECT_EQ(claim.grade, Q::GRADE_ASSUMED);
  EXPECT_EQ(claim.source, Q::SOURCE_PTP);
  EXPECT_EQ(ClaimOfPtp(0, true), UtcClaim());
  EXPECT_EQ(ClaimOfPtp(250, false), UtcClaim());
}

TEST(UtcClaim, IsOfTheMessagesInstantAndAsWideAsTheReadings) {
  time_quality_t message{};
  message.mono_ns = 1'000;
  DescribeUtc(ClaimOfPtp(1, true), {.mono_before = 1'100, .utc_ns = kUtc, .mono_after = 1'300}, message);
  EXPECT_EQ(message.utc_ns, kUtc - 200);
  EXPECT_EQ(message.utc_half_width_ns, 1'100);
  EXPECT_EQ(message.utc_grade, Q::GRADE_ASSUMED);
  DescribeUtc({}, {.mono_before = 1'100, .utc_ns = kUtc, .mono_after = 1'300}, message);
  EXPECT_EQ(message.utc_half_width_ns, -1);
  EXPECT_EQ(message.utc_ns, kUtc - 200) << "UNIX time is stated, without a claim";
}

}  // namespace
}  // namespace axlecast
