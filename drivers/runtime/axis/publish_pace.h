#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Which readings become POSITION messages.
//
// Good ones: at most publish_hz, on average exactly that where readings come faster. At once, beside that rate: the
// first one after a doubtful one that was published, a new datum epoch, and a change of state (the flags of
// kStateFlags), the last at most every 10 ms.
// Doubtful ones: the first of a row at once, but at most every 10 ms, then at 10 Hz until a good one comes. So a
// line that fails at every other reading cannot flood the network.
class PublishPace {
 public:
  // poll_hz 0: as fast as the bus allows. publish_hz 0: only what is published at once.
  PublishPace(double publish_hz, double poll_hz);

  [[nodiscard]] bool Good(MonoNs at, std::int32_t flags, std::int32_t epoch);
  [[nodiscard]] bool Doubtful(MonoNs at);

  static const std::int32_t kStateFlags;
  static constexpr MonoNs kExtraPeriod = 10 * kMillisecond;
  static constexpr MonoNs kDoubtPeriod = 100 * kMillisecond;

 private:
  [[nodiscard]] bool Due(MonoNs at);

  bool every_;  // readings come no faster than they may be published
  MonoNs period_;
  MonoNs due_ = 0;
  bool any_ = false;
  std::int32_t state_ = 0;  // of the last good message
  std::int32_t epoch_ = 0;
  MonoNs extra_at_ = -kExtraPeriod;
  bool in_doubt_ = false;     // the last reading was doubtful
  bool doubt_shown_ = false;  // the last message was
  MonoNs doubt_at_ = -kDoubtPeriod;
};

}  // namespace axlecast
