#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/time/base_claim.h"

namespace axlecast {

// Keeps the newest claim of this host's `axlecast time`. That process publishes its claims also as DRIVER_TIME/<host> on the command
// port, so that a driver need not receive the positions of the whole machine for it. Thread-safe.
class BaseClock final : public BaseClaims {
 public:
  // `clock_id`: of this host. Messages of other clocks are ignored; with 0, all are.
  explicit BaseClock(std::int64_t clock_id) : clock_id_(clock_id) {}

  // Takes an encoded time_quality_t. Anything else is ignored.
  void OnTime(Bytes message);
  // Returns nothing if no claim was received that holds at `mono`: it holds for valid_ms around its own instant.
  [[nodiscard]] std::optional<BaseClaim> At(MonoNs mono) const override;

 private:
  struct Claim {
    MonoNs mono = 0;
    std::int64_t base = 0;
    std::int64_t half_width = -1;  // -1: none
    std::int64_t growth_ppb = 0;
    MonoNs valid = 0;
    std::int64_t base_id = 0;
  };

  const std::int64_t clock_id_;
  mutable std::mutex lock_;
  Claim claim_;
};

}  // namespace axlecast
