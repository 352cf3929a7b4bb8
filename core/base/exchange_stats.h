#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Durations of a window of time: exact smallest and largest, percentiles within 0.8 %.
//
// A log-linear histogram: every power of two is cut into 64 equal buckets, and a percentile is the middle of its
// bucket, so it is off by at most half a bucket, 1/128. Durations below 64 ns are exact; above 2^37 ns (137 s) they
// count as that. Fixed size, constant time per duration.
class ExchangeStats {
 public:
  void Add(MonoNs duration);
  void Clear();

  [[nodiscard]] std::int64_t count() const { return count_; }
  // 0 when the window is empty.
  [[nodiscard]] MonoNs min() const { return min_; }
  [[nodiscard]] MonoNs max() const { return max_; }
  // The duration that a share `q` in (0, 1] of all do not exceed.
  [[nodiscard]] MonoNs Percentile(double q) const;

 private:
  static constexpr int kSubBits = 6;
  static constexpr int kTopBit = 36;
  static constexpr std::size_t kBuckets = std::size_t{kTopBit - kSubBits + 2} << kSubBits;

  [[nodiscard]] static std::size_t BucketOf(std::uint64_t duration);
  [[nodiscard]] static MonoNs MiddleOf(std::size_t bucket);

  std::array<std::uint32_t, kBuckets> buckets_{};
  std::int64_t count_ = 0;
  MonoNs min_ = 0;
  MonoNs max_ = 0;
};

// Counts the durations of exchanges since the driver started, for exchange_times_t. The counters only grow, so that the
// difference of two readings describes the exchanges between them. Fixed size, constant time per exchange.
class ExchangeHistogram {
 public:
  // Upper ends of the buckets: from T-format's 51 us on the wire to a Modbus unit's timeout.
  static constexpr std::array<std::int32_t, 23> kBoundsUs = {
      20,    30,    50,    75,     100,    150,    200,    300,     500,     750,     1'000,    1'500,
      2'000, 3'000, 5'000, 10'000, 20'000, 30'000, 50'000, 100'000, 200'000, 500'000, 1'000'000};

  void Add(MonoNs duration);

  [[nodiscard]] std::int64_t total() const { return total_; }
  [[nodiscard]] MonoNs sum() const { return sum_; }
  // Exchanges that took at most kBoundsUs[i].
  [[nodiscard]] std::array<std::int64_t, kBoundsUs.size()> Within() const;

 private:
  std::array<std::int64_t, kBoundsUs.size()> counts_{};
  std::int64_t total_ = 0;
  MonoNs sum_ = 0;
};

}  // namespace axlecast
