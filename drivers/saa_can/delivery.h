#pragma once

#include <cstdint>

#include "core/device/can.h"
#include "core/device/step.h"

namespace axlecast::saa_can {

// One frame of a procedure on its way onto the bus.
class Delivery {
 public:
  enum class State : std::uint8_t {
    kIdle,
    kStarted,       // about to be handed to the controller
    kRefused,       // its queue is full: the frame is nowhere
    kQueued,        // in the queue
    kNotConfirmed,  // for too long. It goes out as soon as any node acknowledges it, whenever that is
    kOnBus,         // acknowledged by a node
  };

  // Waiting for a busy bus takes some frames' time, below 10 ms: what takes longer has no node to acknowledge it.
  static constexpr MonoNs kConfirmWithin = 500 * kMillisecond;

  void Start(const CanFrame& frame);
  // Any event; its end.
  void On(const Event& event, MonoNs now);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] MonoNs on_bus_at() const { return at_; }
  // When to ask again.
  [[nodiscard]] MonoNs due() const { return state_ == State::kQueued ? at_ + kConfirmWithin : kNever; }

 private:
  CanFrame frame_;
  State state_ = State::kIdle;
  MonoNs at_ = 0;  // of the state
};

}  // namespace axlecast::saa_can
