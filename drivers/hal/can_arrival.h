#pragma once

#include <optional>

#include "core/base/time.h"

namespace axlecast {

// When frames arrived, on CLOCK_MONOTONIC, from the UNIX time (CLOCK_REALTIME) at which the kernel stamped them.
//
// Both clocks are read when a frame is handed over. Between the stamp and that, UNIX time may have been stepped: then,
// and where the kernel gave no stamp, all that is said of a frame is that it came after the one before it, after the
// queue was last empty, and before now.
class CanArrival {
 public:
  explicit CanArrival(const Clock& clock) : clock_(clock) {}

  // The link was opened: nothing arrived before.
  void Start();
  // Nothing waits to be handed over.
  void Empty() { empty_ = clock_.Now(); }
  // Of frames in the order of their arrival. `stamp`: ns UNIX, nothing when the kernel gave none.
  [[nodiscard]] Interval At(std::optional<std::int64_t> stamp);

 private:
  // CLOCK_REALTIME - CLOCK_MONOTONIC is between these; ns.
  struct Offset {
    std::int64_t minimum = 0;
    std::int64_t maximum = 0;
    MonoNs now = 0;  // when it was read
  };
  [[nodiscard]] Offset Read() const;

  const Clock& clock_;
  Offset before_;     // at the frame before
  MonoNs floor_ = 0;  // no frame to come has arrived before it
  MonoNs empty_ = 0;  // nor was in the queue; its stamp may be some us older
};

}  // namespace axlecast
