#pragma once

#include <optional>

#include "core/base/time.h"
#include "drivers/saa_can/cia406/canopen.h"

namespace axlecast::saa_can::cia406 {

// Heartbeat consumer of one node (CiA 301 7.2.8.3.2.2): its NMT state as it last said, and whether it still says
// so.
class NodeWatch {
 public:
  // `limit`: longest time between two heartbeats; 0: any.
  explicit NodeWatch(MonoNs limit) : limit_(limit) {}

  void Restart(MonoNs now) {
    Doubt();
    last_ = now;
    lost_ = false;
  }
  // Nothing is known of its state any more.
  void Doubt() { state_.reset(); }
  // Its state by what it was told, or by what it sends, until it says otherwise.
  void Infer(NmtState state) {
    if (state_ == state) return;
    state_ = state;
    said_ = false;
  }
  // True when a loss ends.
  bool Heard(NmtState state, MonoNs now) {
    // After boot-up a node enters pre-operational by itself (7.3.2.2.1).
    state_ = state == NmtState::kBootUp ? NmtState::kPreOperational : state;
    said_ = true;
    last_ = now;
    const bool ended = lost_;
    lost_ = false;
    return ended;
  }
  // True once for every loss.
  [[nodiscard]] bool BecameLost(MonoNs now) {
    if (now < due()) return false;
    lost_ = true;
    state_.reset();
    return true;
  }
  // When the next heartbeat is to be missed.
  [[nodiscard]] MonoNs due() const { return limit_ == 0 || lost_ ? kNever : last_ + limit_; }
  [[nodiscard]] std::optional<NmtState> state() const { return state_; }
  // The state is as the node said itself.
  [[nodiscard]] bool said() const { return said_; }

 private:
  MonoNs limit_;
  MonoNs last_ = 0;
  bool lost_ = true;
  std::optional<NmtState> state_;
  bool said_ = false;
};

}  // namespace axlecast::saa_can::cia406
