#include "core/time/time_keeper.h"

#include <algorithm>
#include <cstdlib>

namespace axlecast {

using Q = time_quality_t;

TimeKeeper::TimeKeeper(const Limits& limits, std::int64_t own_base_id)
    : limits_(limits), own_base_id_(own_base_id), base_id_(own_base_id), bound_(limits.max_rate_ppb) {}

void TimeKeeper::OnClocks(const HostClocks& clocks) {
  if (clocks_) CheckSlew(clocks);
  clocks_ = clocks;
  if (clocks.raw_after - minute_began_ >= 60 * kSecond) {
    minute_began_ = clocks.raw_after;
    shortest_before_ = shortest_;
    shortest_ = kNever;
  }
}

// Between two readings, each clock advanced by a stretch that is known up to the widths of the readings.
void TimeKeeper::CheckSlew(const HostClocks& clocks) {
  constexpr MonoNs kSuspension = 10 * kMillisecond;
  const MonoNs widths = (clocks.raw_after - clocks.raw_before) + (clocks_->raw_after - clocks_->raw_before);
  const MonoNs raw = clocks.raw_before - clocks_->raw_before;
  const MonoNs mono = clocks.mono - clocks_->mono;
  const MonoNs boot = clocks.boot - clocks_->boot;
  if (boot - mono > kSuspension + widths) {
    BreakEpoch("the host was suspended");
  } else if (std::abs(mono - raw) > Widening(std::max<MonoNs>(raw, 0), limits_.max_slew_ppb) + widths) {
    BreakLimit("CLOCK_MONOTONIC is slewed by more than time: max_slew_ppm");
  }
}

void TimeKeeper::BreakLimit(const std::string& reason) {
  const MonoNs now = clocks_ ? clocks_->raw_after : 0;
  const bool before = limit_exceeded_ && now - *limit_exceeded_ < kForgotten;
  if (!before) limit_doubt_ = kDoubt;
  if (before && now >= doubt_until_) limit_doubt_ = std::min(2 * limit_doubt_, kLongestDoubt);
  limit_exceeded_ = now;
  BreakEpoch(reason, limit_doubt_);
}

void TimeKeeper::BreakEpoch(const std::string& reason, MonoNs doubt) {
  ++epoch_;
  doubt_ = reason;
  bound_.Clear();
  exchanged_.reset();
  if (clocks_) doubt_until_ = clocks_->raw_after + doubt;
}

bool TimeKeeper::OnExchange(const TimeExchange& exchange, std::int64_t base_id) {
  if (IsRoot() || base_id == 0 || !exchange.IsPossible(limits_.max_rate_ppb)) return false;
  if (base_id_ != 0 && base_id != base_id_) BreakEpoch("the root was replaced or started again");
  base_id_ = base_id;
  if (!bound_.Add(exchange)) {
    BreakLimit(
        "an exchange contradicts the one before: a clock was stepped or paused, or its rate is beyond time: "
        "max_rate_ppm");
    static_cast<void>(bound_.Add(exchange));
  }
  exchanged_ = exchange.received;
  ++exchanges_;
  shortest_ = std::min(shortest_, exchange.received - exchange.sent);
  return true;
}

std::int8_t TimeKeeper::State() const {
  if (!clocks_) return Q::STATE_STARTING;
  if (IsRoot()) return clocks_->raw_after < doubt_until_ ? Q::STATE_LOST : Q::STATE_SYNCHRONISED;
  if (!exchanged_) return exchanges_ == 0 ? Q::STATE_STARTING : Q::STATE_LOST;
  const MonoNs age = clocks_->raw_after - *exchanged_;
  if (age > kLost || clocks_->raw_after < doubt_until_) return Q::STATE_LOST;
  return age > kHoldover ? Q::STATE_HOLDOVER : Q::STATE_SYNCHRONISED;
}

// What the base is ahead of CLOCK_MONOTONIC_RAW at the newest reading of the clocks, if that may be claimed.
std::optional<OffsetBound::Range> TimeKeeper::Offset() const {
  const std::int8_t state = State();
  if (state != Q::STATE_SYNCHRONISED && state != Q::STATE_HOLDOVER) return std::nullopt;
  if (IsRoot()) return OffsetBound::Range{0, 0};
  return bound_.At(clocks_->raw_after);
}

std::string TimeKeeper::Reason() const {
  if (clocks_ && clocks_->raw_after < doubt_until_) return doubt_;
  return exchanges_ == 0 ? "no answer of the root yet" : "no answer of the root";
}

MonoNs TimeKeeper::ShortestTrip() const {
  const MonoNs shortest = std::min(shortest_, shortest_before_);
  return shortest == kNever ? 0 : shortest;
}

void TimeKeeper::Describe(time_quality_t& message) const {
  const std::optional<OffsetBound::Range> offset = Offset();
  message.mono_ns = clocks_ ? clocks_->mono : 0;
  message.base_id = base_id_;
  message.base = base_id_ == 0 ? Q::BASE_NONE : Q::BASE_ROOT;
  message.epoch = epoch_;
  message.state = State();
  message.valid_ms = static_cast<std::int32_t>(kValid / kMillisecond);
  message.growth_ppb = static_cast<std::int32_t>((IsRoot() ? 0 : limits_.max_rate_ppb) + limits_.max_slew_ppb);
  message.rtt_min_ns = ShortestTrip();
  message.exchanges = exchanges_;
  message.grade = offset ? Q::GRADE_PROVEN : Q::GRADE_NONE;
  message.source = !offset ? Q::SOURCE_NONE : IsRoot() ? Q::SOURCE_SELF : Q::SOURCE_EXCHANGE;
  message.base_ns = 0;
  message.half_width_ns = -1;
  message.reason = offset ? "" : Reason();
  if (!offset) return;
  const MonoNs earliest = clocks_->raw_before + offset->lowest;
  const MonoNs latest = clocks_->raw_after + offset->highest;
  message.base_ns = earliest + (latest - earliest) / 2;
  message.half_width_ns = latest - message.base_ns;
}

}  // namespace axlecast
