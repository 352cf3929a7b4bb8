#pragma once

#include <atomic>
#include <cstdint>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// Notices a second driver of the same bus by its boot id on our own DRIVER_STATUS channel. Thread-safe.
class DuplicateDriverDetector {
 public:
  // A driver says HELLO once a second: one that has been quiet for longer is gone.
  static constexpr MonoNs kGoneAfter = 3 * kSecond;

  DuplicateDriverDetector(std::int64_t boot_id, const Clock& clock) : boot_id_(boot_id), clock_(clock) {}

  // A message on DRIVER_STATUS/<bus>, ours among them. A GOODBYE of another is none.
  void OnDriverStatus(Bytes message);

  [[nodiscard]] bool Present(MonoNs now) const { return now < present_until_.load(std::memory_order_relaxed); }

 private:
  const std::int64_t boot_id_;
  const Clock& clock_;
  std::atomic<MonoNs> present_until_ = 0;
};

}  // namespace axlecast
