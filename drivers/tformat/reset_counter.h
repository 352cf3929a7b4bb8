#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast::tformat {

// Counts the requests of a reset: "transmit 10 times in one sequence with the interval of 40 ms or more" (TS5669
// spec 9). The strict reading: every other request, another reset too, ends the sequence; so does one that comes
// too early, and it does not begin a new one.
class ResetCounter {
 public:
  static constexpr int kTimes = 10;
  static constexpr MonoNs kInterval = 40 * kMillisecond;

  // A reset with data ID `id` arrived. True when it completes a sequence; the next one begins anew.
  [[nodiscard]] bool OnReset(std::uint8_t id, MonoNs now);
  // Any other request, or a reset that the encoder refuses.
  void Break();

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] std::int64_t broken() const { return broken_; }        // sequences that ended before the tenth
  [[nodiscard]] std::int64_t too_early() const { return too_early_; }  // of these, by a request within 40 ms

 private:
  std::uint8_t id_ = 0;
  int count_ = 0;
  MonoNs last_ = 0;
  std::int64_t broken_ = 0;
  std::int64_t too_early_ = 0;
};

}  // namespace axlecast::tformat
