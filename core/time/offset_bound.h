#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"

namespace axlecast {

// One exchange of datagrams with the root of a time base: a request was sent, the root read its clock when it had the request and
// again before its answer, and the answer was received. `sent` is read before the request leaves and `received` after the answer
// arrived, so that the order of the four instants holds whatever the network does.
struct TimeExchange {
  MonoNs sent = 0;      // ns, CLOCK_MONOTONIC_RAW of this host
  MonoNs received = 0;  // ns, the same clock
  MonoNs asked = 0;     // ns, clock of the base
  MonoNs answered = 0;  // ns, clock of the base

  // Returns false if no network could have caused these instants while the clocks' rates differ by at most `max_rate_ppb`: their order is
  // wrong, they are too large to be instants, or the root claims to have taken longer than the whole exchange. Such an answer
  // proves nothing.
  [[nodiscard]] bool IsPossible(std::int64_t max_rate_ppb) const;
};

// Bounds what the base is ahead of this host's CLOCK_MONOTONIC_RAW. Each exchange gives an interval that contains this offset. The
// intervals are intersected; with time, the intersection grows by the greatest difference of the two clocks' rates.
class OffsetBound {
 public:
  struct Range {
    MonoNs lowest = 0;
    MonoNs highest = 0;
  };

  // `max_rate_ppb`: the two clocks' rates differ by at most this, in 1e-9.
  explicit OffsetBound(std::int64_t max_rate_ppb) : max_rate_ppb_(max_rate_ppb) {}

  // Takes a possible exchange. Returns false if it contradicts the earlier ones: a clock was stepped or paused, or its rate is beyond
  // the limit. The bound is then that of this exchange alone.
  [[nodiscard]] bool Add(const TimeExchange& exchange);
  // Returns the bound at an instant of this host; nothing before the first exchange.
  [[nodiscard]] std::optional<Range> At(MonoNs raw) const;
  void Clear() { known_ = false; }

 private:
  struct Edge {
    MonoNs offset = 0;
    MonoNs at = 0;  // this host's instant of which it holds
  };

  [[nodiscard]] Range Grown(MonoNs raw) const;

  std::int64_t max_rate_ppb_;
  bool known_ = false;
  Edge highest_;
  Edge lowest_;
};

// Returns by how much an interval grows in `time`, forwards or backwards, at `ppb` parts in 1e9; rounded up.
[[nodiscard]] MonoNs Widening(MonoNs time, std::int64_t ppb);

}  // namespace axlecast
