#include "tools/fleet/ship/ship_plan.h"

#include <algorithm>

namespace axlecast {

void TokenBucket::Fill(MonoNs now) {
  if (filled_ == std::numeric_limits<MonoNs>::min()) filled_ = now;
  const MonoNs passed = std::max<MonoNs>(0, now - filled_);
  // A debt is paid over any time; whatever is left, one second fills the bucket.
  const double earned = static_cast<double>(passed) / 1e9 * static_cast<double>(rate_);
  if (earned < 1) return;
  tokens_ = earned >= static_cast<double>(rate_ - tokens_) ? rate_ : tokens_ + static_cast<std::int64_t>(earned);
  filled_ = now;
}

MonoNs TokenBucket::NextAt(MonoNs now) {
  if (rate_ == 0) return now;
  Fill(now);
  if (tokens_ > 0) return now;
  return now + static_cast<MonoNs>(static_cast<double>(1 - tokens_) / static_cast<double>(rate_) * 1e9) +
         kMicrosecond;
}

void TokenBucket::Take(std::int64_t bytes, MonoNs now) {
  if (rate_ == 0) return;
  Fill(now);
  tokens_ -= bytes;
}

bool ShipPlan::IsBefore(const WaitingLog& one, const WaitingLog& other) const {
  if (one.live != other.live) return one.live;
  if (one.live) return one.shipped_at < other.shipped_at;
  return newest_first_ ? one.start_utime > other.start_utime : one.start_utime < other.start_utime;
}

std::optional<std::size_t> ShipPlan::Next(std::span<const WaitingLog> logs, MonoNs now) {
  const bool limited = bucket_.NextAt(now) > now;
  std::optional<std::size_t> next;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const WaitingLog& log = logs[i];
    if (log.waiting <= 0) continue;
    if (log.live ? !log.more && now - log.shipped_at < kLiveInterval : limited) continue;
    if (!next || IsBefore(log, logs[*next])) next = i;
  }
  return next;
}

MonoNs ShipPlan::NextAt(std::span<const WaitingLog> logs, MonoNs now) {
  MonoNs at = kNever;
  for (const WaitingLog& log : logs) {
    if (log.waiting <= 0) continue;
    at = std::min(at, !log.live ? bucket_.NextAt(now) : log.more ? now : log.shipped_at + kLiveInterval);
  }
  return at == kNever ? at : std::max(at, now);
}

void ShipPlan::Shipped(const WaitingLog& log, std::int64_t bytes, MonoNs now) {
  if (!log.live) bucket_.Take(bytes, now);
}

}  // namespace axlecast
