#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <axlecast/time_quality_t.hpp>

#include "core/base/time.h"
#include "core/time/chrony_packet.h"

namespace axlecast {

// What is known of UNIX time of this host: the fields utc_* of time_quality_t. The claim is that of the daemon that keeps the clock, and
// true only if its servers are right. It is never mixed with the proven base.
struct UtcClaim {
  static constexpr MonoNs kFresh = 3 * kSecond;  // a reply of chronyd is used for this time

  std::int64_t half_width_ns = -1;  // UTC is within UNIX time +- this; -1: no claim
  std::int8_t grade = time_quality_t::GRADE_NONE;
  std::int8_t source = time_quality_t::SOURCE_NONE;
  std::string reference = {};

  friend bool operator==(const UtcClaim&, const UtcClaim&) = default;
};

// Returns chronyd's claim at the UNIX time `utc_ns`: |correction| + dispersion + delay / 2, as its manual states it, and
// (skew + |residual frequency| + 50 ppm) for each second since its last update. If it follows no reference, there is no claim.
[[nodiscard]] UtcClaim ClaimOfChrony(const ChronyTracking& tracking, std::int64_t utc_ns);

// Returns the claim of a clock that is kept, but not by chronyd: what the machine file grants it as `time: ptp_bound_us`. No claim if
// the bound is 0, or if the kernel states that nothing keeps the clock.
[[nodiscard]] UtcClaim ClaimOfPtp(int bound_us, bool synchronised);

// UNIX time, read between two readings of CLOCK_MONOTONIC.
struct UtcReading {
  MonoNs mono_before = 0;
  std::int64_t utc_ns = 0;
  MonoNs mono_after = 0;
};

// Sets the fields utc_* of the message for its mono_ns. Adds what the readings leave open to the half width.
void DescribeUtc(const UtcClaim& claim, const UtcReading& reading, time_quality_t& message);

}  // namespace axlecast
