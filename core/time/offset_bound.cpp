#include "core/time/offset_bound.h"

#include <cstdlib>

namespace axlecast {
namespace {

constexpr MonoNs kLatest = INT64_MAX / 4;  // 73 years: sums and differences of such instants do not overflow

bool IsInstant(MonoNs instant) { return instant >= 0 && instant < kLatest; }

}  // namespace

MonoNs Widening(MonoNs time, std::int64_t ppb) { return (std::abs(time) / kMillisecond + 1) * ppb / 1'000 + 1; }

bool TimeExchange::IsPossible(std::int64_t max_rate_ppb) const {
  return IsInstant(sent) && IsInstant(received) && IsInstant(asked) && IsInstant(answered) && sent <= received &&
         asked <= answered && answered - asked <= received - sent + Widening(received - sent, max_rate_ppb);
}

// The base had reached at most `asked` at `sent`, and at least `answered` at `received`.
bool OffsetBound::Add(const TimeExchange& exchange) {
  const Edge highest = {exchange.asked - exchange.sent, exchange.sent};
  const Edge lowest = {exchange.answered - exchange.received, exchange.received};
  if (known_) {
    const Range before = Grown(exchange.received);
    if (before.highest > highest.offset + Widening(exchange.received - exchange.sent, max_rate_ppb_))
      highest_ = highest;
    if (before.lowest < lowest.offset) lowest_ = lowest;
    const Range after = Grown(exchange.received);
    if (after.lowest <= after.highest) return true;
  }
  const bool first = !known_;
  known_ = true;
  highest_ = highest;
  lowest_ = lowest;
  return first;
}

OffsetBound::Range OffsetBound::Grown(MonoNs raw) const {
  return {lowest_.offset - Widening(raw - lowest_.at, max_rate_ppb_),
          highest_.offset + Widening(raw - highest_.at, max_rate_ppb_)};
}

std::optional<OffsetBound::Range> OffsetBound::At(MonoNs raw) const {
  if (!known_) return std::nullopt;
  return Grown(raw);
}

}  // namespace axlecast
