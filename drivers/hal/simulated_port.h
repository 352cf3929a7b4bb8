#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.h"
#include "core/device/simulator.h"

namespace axlecast {

// The simulator's end of a bus, whatever carries it: brings what the host sends to the simulator, and what the
// simulator transmits to the host.
class SimulatedPort {
 public:
  SimulatedPort(Simulator& simulator, const Clock& clock) : simulator_(simulator), clock_(clock) {}
  virtual ~SimulatedPort() = default;
  SimulatedPort(const SimulatedPort&) = delete;
  SimulatedPort& operator=(const SimulatedPort&) = delete;

  // Lets hosts in; an empty string when done, else the cause and the remedy. A plugged one is unplugged first.
  [[nodiscard]] virtual std::string Plug() = 0;
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

}  // namespace axlecast
