#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/device/link.h"
#include "core/device/simulator.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The end of a bus at the simulator: passes what the host sends to the simulator, and what the simulator transmits to the
// host.
class SimulatedPort {
 public:
  SimulatedPort(Simulator& simulator, const Clock& clock) : simulator_(simulator), clock_(clock) {}
  virtual ~SimulatedPort() = default;
  SimulatedPort(const SimulatedPort&) = delete;
  SimulatedPort& operator=(const SimulatedPort&) = delete;

  // Lets hosts connect. The error contains the cause and the remedy. A plugged port is unplugged first.
  [[nodiscard]] virtual Result<> Plug() = 0;
  // The host loses its line, as if the adapter were unplugged.
  virtual void Unplug() = 0;
  [[nodiscard]] virtual bool HasHost() const = 0;

  // Readable when Serve has work; -1: only NextDue applies.
  [[nodiscard]] virtual int FileDescriptor() const = 0;
  // When Serve has work without that; kNever: never.
  [[nodiscard]] virtual MonoNs NextDue() const = 0;
  // Processes what has come, without waiting.
  virtual void Serve() = 0;
  // What is sent without a host, or to a host that does not read, is lost.
  virtual void Transmit(Bytes bytes) = 0;

  // Passes a new rate of the host to the simulator. Call it before the bytes of the host are passed.
  void PassBaud() {
    const std::int64_t baud = Baud();
    if (baud == 0 || baud == passed_) return;
    passed_ = baud;
    simulator_.OnBaud(baud);
  }

 protected:
  [[nodiscard]] Simulator& simulator() { return simulator_; }
  [[nodiscard]] MonoNs Now() const { return clock_.Now(); }

 private:
  // The rate that the host has set; 0 without a host, or on a bus without a rate.
  [[nodiscard]] virtual std::int64_t Baud() const = 0;

  Simulator& simulator_;
  const Clock& clock_;
  std::int64_t passed_ = 0;
};

// A simulated CAN or SPI bus is a SOCK_SEQPACKET socket in the run directory. The simulator listens, and one host at a time
// connects. The first packet of the simulator is the name of the protocol. It is sent at once; if the bus has a host already,
// the new connection is closed without it. A peer that sends a packet outside the protocol is disconnected.

inline constexpr std::size_t kLongestSimulatedPacket = 512;

// The end of the host.
class SimulatedSocket {
 public:
  // Connects, and checks that the simulator behind `path` uses `protocol`. The error contains the cause and the remedy.
  [[nodiscard]] Result<> Connect(const std::string& path, std::string_view protocol, const Clock& clock);
  void Close() { socket_.Reset(); }
  [[nodiscard]] bool IsConnected() const { return socket_.valid(); }
  // Readable when Receive has a packet, or the simulator has closed the connection.
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }

  // Returns kFull if the simulator does not read fast enough.
  [[nodiscard]] FrameLink::SendResult Send(Bytes packet);
  // Reads a packet. Returns kOk, kTimeout (no packet waits) or kLost, also for a packet longer than `into`.
  [[nodiscard]] ByteLink::ReadResult Receive(std::span<std::uint8_t> into);

 private:
  Descriptor socket_;
};

// The end of the simulator.
class SimulatedSocketPort {
 public:
  SimulatedSocketPort() = default;
  ~SimulatedSocketPort() { Close(); }
  SimulatedSocketPort(const SimulatedSocketPort&) = delete;
  SimulatedSocketPort& operator=(const SimulatedSocketPort&) = delete;

  // Creates the socket, and replaces the socket of a process that has ended. The caller makes sure that no other process uses
  // the path. Only processes of this user can connect. `protocol` outlives the port.
  [[nodiscard]] Result<> Listen(const std::string& path, std::string_view protocol);
  // Removes the path and disconnects the host.
  void Close();
  [[nodiscard]] bool IsListening() const { return listener_.valid(); }
  [[nodiscard]] bool HasHost() const { return host_.valid(); }
  // A host that has closed the connection remains until Next has returned its last packet.
  [[nodiscard]] bool HostHasGone() const;
  void DropHost() { host_.Reset(); }
  // Readable when Welcome or Next has work.
  [[nodiscard]] int FileDescriptor() const { return events_.get(); }

  // While `receives` is false, packets of the host wait in its socket.
  void SetReceiving(bool receives);
  // Accepts a new host, and refuses a second one. Returns true if Next has work: packets of a new host, or the last ones of a
  // host that has closed the connection.
  [[nodiscard]] bool Welcome();
  // Returns the next packet of the host, or nothing. It is valid until the next call.
  [[nodiscard]] std::optional<Bytes> Next();
  // Returns false if the host has closed the connection or does not read.
  [[nodiscard]] bool Send(Bytes packet);

 private:
  [[nodiscard]] Descriptor Accept();
  [[nodiscard]] bool Greet(Descriptor caller);

  std::string path_;
  std::string_view protocol_;
  Descriptor events_;
  Descriptor listener_;
  Descriptor host_;
  Descriptor next_;  // connected before the last packets of host_, which has closed its connection, were read
  bool receives_ = true;
  std::array<std::uint8_t, kLongestSimulatedPacket> packet_{};
};

}  // namespace axlecast
