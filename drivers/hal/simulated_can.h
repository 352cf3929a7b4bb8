#pragma once

#include <deque>
#include <string>

#include "core/base/time.h"
#include "core/device/link.h"
#include "drivers/hal/line_reader.h"
#include "drivers/hal/simulated_port.h"

namespace axlecast {

// A simulated CAN bus: a socket as in simulated_port.h, <bus>.can in the run directory, protocol "axlecast-can-1". Each packet is
// one byte, its kind, and its content:
//   host      'B'  bit/s, 4 bytes, most significant first: once, before all other packets
//             'F'  a frame (ToPacket of core/device/can.h)
//   simulator 'F'  a frame of a node
//             'A'  a frame of the host that a node has acknowledged
//             'N'  a frame of the host that no node has acknowledged. As by a controller, it is repeated until a node
//                  acknowledges it ('A'). Later frames of the host wait.

// The end of the driver. Timestamps are those of the read.
class SimulatedCan final : public FrameLink {
 public:
  // `path`: of the socket of the simulator.
  SimulatedCan(std::string path, std::int64_t bitrate, const Clock& clock)
      : path_(std::move(path)), bitrate_(bitrate), clock_(clock), reader_(clock) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return socket_.IsConnected(); }
  [[nodiscard]] SendResult Send(const CanFrame& frame) override;
  [[nodiscard]] Status Receive(Received& received) override;
  // Error-passive after a frame that no node acknowledged; acknowledged frames restore the state (ISO 11898-1 12.1.4).
  [[nodiscard]] CanController Controller() override { return controller_; }
  [[nodiscard]] Status Wait(MonoNs until) override { return reader_.Wait(until); }
  void Wake() override { reader_.Wake(); }
  [[nodiscard]] LineErrors Errors() const override { return {}; }

 private:
  void Count(bool acknowledged);

  const std::string path_;
  const std::int64_t bitrate_;
  const Clock& clock_;
  SimulatedSocket socket_;
  LineReader reader_;
  CanController controller_;
};

// The end of the simulator: controller and bus. As with a real interface, a frame that no node has acknowledged still waits after
// its host has ended. Unplugging the port drops it.
class SimulatedCanPort final : public SimulatedPort {
 public:
  SimulatedCanPort(std::string path, Simulator& simulator, const Clock& clock)
      : SimulatedPort(simulator, clock), path_(std::move(path)) {}

  [[nodiscard]] Result<> Plug() override;
  void Unplug() override;
  [[nodiscard]] bool HasHost() const override { return bitrate_ != 0; }
  [[nodiscard]] int FileDescriptor() const override { return socket_.FileDescriptor(); }
  [[nodiscard]] MonoNs NextDue() const override { return again_at_; }
  void Serve() override;
  void Transmit(Bytes bytes) override;

 private:
  // A frame of a host that no node has acknowledged yet.
  struct Waiting {
    CanFrame frame;
    bool own = true;     // of the present host
    bool tried = false;  // sent once without acknowledge
  };

  [[nodiscard]] std::int64_t Baud() const override { return bitrate_; }
  void ReceiveAll();
  [[nodiscard]] bool Take(Bytes packet);
  void SendWaiting();
  void UpdateReceiving();
  [[nodiscard]] bool Send(Waiting& waiting);
  void SendToHost(char kind, Bytes frame);

  const std::string path_;
  SimulatedSocketPort socket_;
  std::int64_t bitrate_ = 0;  // 0: no host, or it has not sent its rate yet
  std::deque<Waiting> waiting_;
  MonoNs again_at_ = kNever;  // when the first of them is sent again
};

}  // namespace axlecast
