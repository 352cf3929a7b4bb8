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
#include "core/device/simulator.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The simulator's end of a bus, whatever carries it: brings what the host sends to the simulator, and what the
// simulator transmits to the host.
class SimulatedPort {
 public:
  SimulatedPort(Simulator& simulator, const Clock& clock) : simulator_(simulator), clock_(clock) {}
  virtual ~SimulatedPort() = default;
  SimulatedPort(const SimulatedPort&) = delete;
  SimulatedPort& operator=(const SimulatedPort&) = delete;

  // Lets hosts connect. The error contains the cause and the remedy. A plugged port is unplugged first.
  [[nodiscard]] virtual Result<> Plug() = 0;
  // The host loses its line, as with an adapter that is pulled out.
  virtual void Unplug() = 0;
  [[nodiscard]] virtual bool HasHost() const = 0;

  // Readable when Serve has work; -1: only NextDue tells.
  [[nodiscard]] virtual int FileDescriptor() const = 0;
  // When Serve has work even so; kNever: not by itself.
  [[nodiscard]] virtual MonoNs NextDue() const = 0;
  // Looks what has come, without waiting.
  virtual void Serve() = 0;
  // A line without a host, or with one that does not read, loses what is sent.
  virtual void Transmit(Bytes bytes) = 0;

  // Tells the simulator of the rate that the host has set, when it is a new one: before all that comes from the host.
  void TellBaud() {
    const std::int64_t baud = Baud();
    if (baud == 0 || baud == told_) return;
    told_ = baud;
    simulator_.OnBaud(baud);
  }

 protected:
  [[nodiscard]] Simulator& simulator() { return simulator_; }
  [[nodiscard]] MonoNs Now() const { return clock_.Now(); }

 private:
  // That the host has set; 0 while there is none, or where a bus has none.
  [[nodiscard]] virtual std::int64_t Baud() const = 0;

  Simulator& simulator_;
  const Clock& clock_;
  std::int64_t told_ = 0;
};

// What carries a simulated bus that is no line of characters: a SOCK_SEQPACKET socket in the run directory. The
// simulator listens, one host at a time connects. The simulator's first packet is the protocol's name; it comes at once,
// unless the bus has a host already: that connection is closed without it. All that follows is the protocol's own. Who
// sends what is none of it is cut off.

inline constexpr std::size_t kLongestSimulatedPacket = 512;

// The host's end.
class SimulatedSocket {
 public:
  enum class Status : std::uint8_t { kOk, kNothing, kFull, kLost };

  // Connects, and checks that the simulator behind `path` uses `protocol`. The error contains the cause and the remedy.
  [[nodiscard]] Result<> Connect(const std::string& path, std::string_view protocol, const Clock& clock);
  void Close() { socket_.Reset(); }
  [[nodiscard]] bool IsConnected() const { return socket_.valid(); }
  // Readable when Receive has something, and when the simulator has gone.
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }

  // kOk, kFull (the simulator does not take it yet) or kLost.
  [[nodiscard]] Status Send(Bytes packet);
  // kOk, kNothing or kLost. A packet longer than `into` is nonsense: kLost.
  struct Received {
    Status status = Status::kNothing;
    std::size_t size = 0;
  };
  [[nodiscard]] Received Receive(std::span<std::uint8_t> into);

 private:
  Descriptor socket_;
};

// The simulator's end.
class SimulatedSocketPort {
 public:
  SimulatedSocketPort() = default;
  ~SimulatedSocketPort() { Close(); }
  SimulatedSocketPort(const SimulatedSocketPort&) = delete;
  SimulatedSocketPort& operator=(const SimulatedSocketPort&) = delete;

  // Takes the path over from a process that has gone; whoever calls makes sure that none lives. The error
  // contains the cause and the remedy. Only this user's processes reach it. `protocol` outlives the port.
  [[nodiscard]] Result<> Listen(const std::string& path, std::string_view protocol);
  // The path and the host go.
  void Close();
  [[nodiscard]] bool IsListening() const { return listener_.valid(); }
  [[nodiscard]] bool HasHost() const { return host_.valid(); }
  // A host that has gone stays until Next has handed over the last that it sent.
  [[nodiscard]] bool HostHasGone() const;
  void DropHost() { host_.Reset(); }
  // Readable when Welcome or Next has work.
  [[nodiscard]] int FileDescriptor() const { return events_.get(); }

  // Whether packets of the host are wanted: while they are not they pile up in its socket.
  void Want(bool packets);
  // Greets a new host, sends away a second one. True when Next has work: a new host's, or the last of one that has gone.
  [[nodiscard]] bool Welcome();
  // The host's next packet; none when nothing has come. It stays valid until the next call.
  [[nodiscard]] std::optional<Bytes> Next();
  // False when the host has gone or reads nothing any more.
  [[nodiscard]] bool Send(Bytes packet);

 private:
  [[nodiscard]] Descriptor Accept();
  [[nodiscard]] bool Greet(Descriptor caller);

  std::string path_;
  std::string_view protocol_;
  Descriptor events_;
  Descriptor listener_;
  Descriptor host_;
  Descriptor next_;  // has called while the last packets of host_, which has gone, were still there
  bool wanted_ = true;
  std::array<std::uint8_t, kLongestSimulatedPacket> packet_{};
};

}  // namespace axlecast
