#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// How long exchanges took since the driver started: what exchange_times_t tells. It only grows, so that whoever looks
// at any two instants knows the exchanges between them. Fixed size, a few steps per exchange.
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
