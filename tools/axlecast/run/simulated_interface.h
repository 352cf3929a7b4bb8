#pragma once

#include <string>

#include "drivers/hal/can_socket.h"
#include "drivers/hal/simulated_port.h"

namespace axlecast {

// The simulated nodes of a CAN bus on an interface of Linux: beside real nodes, or opposite a driver on another interface
// of the same bus. Frames are acknowledged by the interface's controller, whatever the simulator says.
class SimulatedInterface final : public SimulatedPort {
 public:
  // `interface`: can1.
  SimulatedInterface(const std::string& interface, Simulator& simulator, const Clock& clock)
      : SimulatedPort(simulator, clock), socket_({.interface = interface, .filters = {}, .sole = false}, clock) {}

  // The interface is up; later it may go and come back.
  [[nodiscard]] std::string Plug() override;
  void Unplug() override;
  [[nodiscard]] bool HasHost() const override { return socket_.IsOpen(); }
  [[nodiscard]] int FileDescriptor() const override { return socket_.FileDescriptor(); }
  [[nodiscard]] MonoNs NextDue() const override { return reopen_at_; }
  void Serve() override;
  void Transmit(Bytes bytes) override;

 private:
  [[nodiscard]] std::int64_t Baud() const override { return bitrate_; }

  CanSocket socket_;
  std::int64_t bitrate_ = 0;
  MonoNs reopen_at_ = kNever;
};

}  // namespace axlecast
