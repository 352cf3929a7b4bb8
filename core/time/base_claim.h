#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"

namespace axlecast {

// Where an instant of this host's CLOCK_MONOTONIC lies on the time base of the machine: within base_ns +- half_width_ns.
struct BaseClaim {
  std::int64_t base_id = 0;  // time_quality_t base_id; 0: no claim
  std::int64_t base_ns = 0;
  std::int64_t half_width_ns = 0;
};

// The claims of this host about the time base. Thread-safe.
class BaseClaims {
 public:
  virtual ~BaseClaims() = default;
  // Returns the claim for `mono`, an instant near the present; nothing while this host has none.
  [[nodiscard]] virtual std::optional<BaseClaim> At(MonoNs mono) const = 0;
};

}  // namespace axlecast
