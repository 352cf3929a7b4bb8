#include "core/time/utc_claim.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace axlecast {
namespace {

using Q = time_quality_t;

constexpr double kGrowthPpm = 50;     // of a quartz whose frequency chronyd does not correct any more
constexpr double kMaxWidth = 1e15;    // ns, eleven days: nothing is known
constexpr std::size_t kMaxName = 40;  // bytes, time_quality_t.lcm

}  // namespace

UtcClaim ClaimOfChrony(const ChronyTracking& tracking, std::int64_t utc_ns) {
  UtcClaim claim{.source = Q::SOURCE_CHRONY,
                 .reference = tracking.reference_id == ChronyTracking::kLocalReference
                                  ? "its own clock"
                                  : tracking.reference.substr(0, kMaxName)};
  if (!tracking.FollowsReference()) return claim;
  const double age_s = std::max(0.0, static_cast<double>(utc_ns - tracking.reference_utc_ns) * 1e-9);
  const double growth = (tracking.skew_ppm + std::abs(tracking.residual_frequency_ppm) + kGrowthPpm) * 1e-6;
  const double width_s = std::abs(tracking.correction_s) + tracking.root_dispersion_s +
                         std::abs(tracking.root_delay_s) / 2 + growth * age_s;
  if (width_s * 1e9 > kMaxWidth) return claim;
  claim.half_width_ns = static_cast<std::int64_t>(std::ceil(width_s * 1e9));
  claim.grade = Q::GRADE_CLAIMED;
  return claim;
}

UtcClaim ClaimOfPtp(int bound_us, bool synchronised) {
  if (bound_us <= 0 || !synchronised) return {};
  return {.half_width_ns = bound_us * std::int64_t{1'000}, .grade = Q::GRADE_ASSUMED, .source = Q::SOURCE_PTP};
}

// The kernel slews UNIX time and CLOCK_MONOTONIC by the same amount: between the readings, they advance equally.
void DescribeUtc(const UtcClaim& claim, const UtcReading& reading, time_quality_t& message) {
  const MonoNs middle = reading.mono_before + (reading.mono_after - reading.mono_before) / 2;
  message.utc_ns = reading.utc_ns - (middle - message.mono_ns);
  message.utc_half_width_ns = -1;
  if (claim.half_width_ns >= 0) {
    message.utc_half_width_ns = claim.half_width_ns + (reading.mono_after - reading.mono_before + 1) / 2;
  }
  message.utc_grade = claim.grade;
  message.utc_source = claim.source;
  message.utc_reference = claim.reference;
}

}  // namespace axlecast
