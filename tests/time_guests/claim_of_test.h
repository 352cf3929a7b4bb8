#pragma once

#include <axlecast/time_quality_t.hpp>
#include <cstdint>

#include "core/base/time.h"
#include "tests/time_guests/guest_run.h"

// What both tests of judges claim of their guests.
namespace axlecast {

inline constexpr std::int64_t kBase = 9;
inline constexpr MonoNs kHalfWidth = 700 * kMicrosecond;   // of a claim of b
inline constexpr MonoNs kFromMiddle = 200 * kMicrosecond;  // the truth, by the claims of b

// `mono`: the instant on the clock of the guest; `base`: the true one.
[[nodiscard]] inline time_quality_t ClaimOf(const Guest& of, MonoNs mono, MonoNs base) {
  time_quality_t claim{};
  const bool root = of.own_base_id != 0;
  claim.host = of.host;
  claim.clock_id = of.clock_id;
  claim.mono_ns = mono;
  claim.base_id = kBase;
  claim.base_ns = base + (root ? 0 : kFromMiddle);
  claim.half_width_ns = root ? 1'000 : kHalfWidth;
  claim.growth_ppb = 1'100'000;
  claim.valid_ms = 1'000;
  claim.grade = time_quality_t::GRADE_PROVEN;
  claim.source = root ? time_quality_t::SOURCE_SELF : time_quality_t::SOURCE_EXCHANGE;
  return claim;
}

}  // namespace axlecast
