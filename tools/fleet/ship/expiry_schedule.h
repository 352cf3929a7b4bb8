#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"

namespace axlecast {

// States when a shipper asks the database to delete what is older than its retention: some minutes after its first connection, then
// about once an hour. The database does it for the first of many shippers that ask within an hour.
class ExpirySchedule {
 public:
  static constexpr MonoNs kFirst =
      120 * kSecond;  // at the earliest: what waited for the connection is shipped before
  static constexpr MonoNs kSpread =
      300 * kSecond;  // of the first time, so that shippers that start together do not ask together
  static constexpr MonoNs kInterval = 3600 * kSecond;

  // Returns true if it is time, and begins the next interval. `seed`: differs from shipper to shipper.
  [[nodiscard]] bool IsDue(MonoNs now, std::uint64_t seed) {
    constexpr std::uint64_t kMixer = 0x9E37'79B9'7F4A'7C15;  // neighbouring seeds become distant
    if (!next_) next_ = now + kFirst + static_cast<MonoNs>((seed * kMixer) >> 11U) % kSpread;
    if (now < *next_) return false;
    next_ = now + kInterval;
    return true;
  }

 private:
  std::optional<MonoNs> next_;  // nothing: not started
};

}  // namespace axlecast
