#include "core/time/base_clock.h"

#include <algorithm>
#include <axlecast/time_quality_t.hpp>
#include <cstdlib>

#include "core/messages/message.h"
#include "core/time/offset_bound.h"

namespace axlecast {
namespace {

constexpr std::int64_t kLatest = INT64_MAX / 16;          // 18 years: sums of such instants do not overflow
constexpr std::int64_t kMaxHalfWidth = 86'400 * kSecond;  // a wider claim is not used
constexpr std::int64_t kMaxGrowth = 1'000'000'000;        // ppb
constexpr std::int64_t kMaxValid = 60 * kSecond;          // of a claim

bool IsInstant(std::int64_t ns) { return ns >= 0 && ns < kLatest; }

bool IsClaim(const time_quality_t& quality) {
  return quality.grade == time_quality_t::GRADE_PROVEN && quality.base_id != 0 && quality.half_width_ns >= 0 &&
         quality.half_width_ns < kMaxHalfWidth && quality.growth_ppb >= 0 && quality.growth_ppb <= kMaxGrowth &&
         IsInstant(quality.base_ns);
}

}  // namespace

void BaseClock::OnTime(Bytes message) {
  const auto quality = DecodeMessage<time_quality_t>(message);
  if (!quality || clock_id_ == 0 || quality->clock_id != clock_id_ || !IsInstant(quality->mono_ns)) return;
  const std::lock_guard<std::mutex> guard(lock_);
  claim_ = {.mono = quality->mono_ns,
            .base = quality->base_ns,
            .half_width = IsClaim(*quality) ? quality->half_width_ns : -1,
            .growth_ppb = quality->growth_ppb,
            .valid = std::clamp<MonoNs>(quality->valid_ms * kMillisecond, 0, kMaxValid),
            .base_id = quality->base_id};
}

std::optional<BaseClaim> BaseClock::At(MonoNs mono) const {
  const std::lock_guard<std::mutex> guard(lock_);
  if (claim_.half_width < 0 || !IsInstant(mono)) return std::nullopt;
  const MonoNs distance = mono - claim_.mono;
  if (std::abs(distance) > claim_.valid) return std::nullopt;
  return BaseClaim{.base_id = claim_.base_id,
                   .base_ns = claim_.base + distance,
                   .half_width_ns = claim_.half_width + Widening(std::abs(distance), claim_.growth_ppb)};
}

}  // namespace axlecast
