#pragma once

#include <deque>
#include <string>

#include "core/base/time.h"
#include "core/device/link.h"
#include "drivers/hal/line_reader.h"
#include "drivers/hal/simulated_port.h"

namespace axlecast {

// A simulated CAN bus: a socket as in drivers/hal/simulated_socket.h, <bus>.can in the run directory, protocol
// "axlecast-can-1". Each packet is one byte, its kind, and what belongs to it:
//   host      'B'  bit/s, 4 bytes, most significant first: once, before all others
//             'F'  a frame (ToPacket of core/can_frame.h)
//   simulator 'F'  a frame of a node
//             'A'  the host's frame was on the bus, and a node has acknowledged it; the frame
//             'N'  no node has acknowledged the host's frame; the frame. It is sent again and again until one does
//                  ('A'), and what the host sends meanwhile waits behind it, as with a controller

// The driver's end. Instants are those of the read.
class SimulatedCan final : public FrameLink {
 public:
  // `path`: where the simulator listens.
  SimulatedCan(std::string path, std::int64_t bitrate, const Clock& clock)
      : path_(std::move(path)), bitrate_(bitrate), clock_(clock), reader_(clock) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return socket_.IsConnected(); }
  [[nodiscard]] SendResult Send(const CanFrame& frame) override;
  [[nodiscard]] Status Receive(Received& received) override;
  // Error passive from the first frame that no node acknowledged; acknowledged ones bring it back (ISO 11898-1 12.1.4).
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

// The simulator's end: controller and bus. As with a real interface, what no node has acknowledged goes on waiting when
// its host has gone; pulling the port out drops it.
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
  // A frame of a host that no node has acknowledged.
  struct Waiting {
    CanFrame frame;
    bool own = true;     // of the host that is there now
    bool tried = false;  // and nobody has acknowledged it
  };

  [[nodiscard]] std::int64_t Baud() const override { return bitrate_; }
  void Hear();
  [[nodiscard]] bool Take(Bytes packet);
  void SendWaiting();
  void MindQueue();
  [[nodiscard]] bool Send(Waiting& waiting);
  void Tell(char kind, Bytes frame);

  const std::string path_;
  SimulatedSocketPort socket_;
  std::int64_t bitrate_ = 0;  // 0: no host, or one that has not told yet
  std::deque<Waiting> waiting_;
  MonoNs again_at_ = kNever;  // when the first of them is tried again
};

}  // namespace axlecast
