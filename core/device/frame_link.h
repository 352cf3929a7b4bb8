#pragma once

#include <cstdint>

#include "core/device/can_controller.h"
#include "core/device/can_frame.h"
#include "core/device/link.h"

namespace axlecast {

// A line that carries CAN frames. drivers/hal/can_socket.h is the real one.
class FrameLink : public Link {
 public:
  enum class SendResult : std::uint8_t {
    kQueued,  // it goes out when the bus is free; Receive tells of it when some node has acknowledged it
    kFull,    // the interface's queue is full, and the frame is not in it
    kLost,    // as Status::kLost
  };
  [[nodiscard]] virtual SendResult Send(const CanFrame& frame) = 0;

  struct Received {
    CanFrame frame;
    Interval at;       // holds the instant at which it had arrived, as the kernel saw it
    bool own = false;  // one that this link sent was on the bus, and a node has acknowledged it
  };
  // The next of what has come, without waiting: kOk, kTimeout or kLost.
  [[nodiscard]] virtual Status Receive(Received& received) = 0;

  // Asks the kernel; may take some 10 us.
  [[nodiscard]] virtual CanController Controller() = 0;
};

}  // namespace axlecast
