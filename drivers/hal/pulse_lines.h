#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "core/device/step.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Real output lines, driven with libgpiod. A pulse is never shorter than requested; under load it may be longer.
//
// When the process ends, even during a pulse, the kernel releases the lines. Most controllers then make the line an input, or
// leave it as it was driven last. A line whose low level acts (CLR sets a zero) therefore needs an external pull-up, and a
// device that tolerates a shortened pulse.
class GpioLines final : public PulseLines {
 public:
  GpioLines(std::vector<PulseLineConfig> lines, const Clock& clock);
  ~GpioLines() override;

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  // Sleeps, and spins during the last 100 us of `low`.
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override;

 private:
  class Line;

  [[nodiscard]] Result<> Claim(const PulseLineConfig& config);

  std::vector<PulseLineConfig> lines_;
  const Clock& clock_;
  std::vector<std::unique_ptr<Line>> claimed_;  // in the order of lines_
};

// The lines of a simulated bus. When a pulse ends, it is sent to the simulator of the bus as one datagram.
class SimulatedLines final : public PulseLines {
 public:
  // `path`: of the socket of the simulator, <bus>.lines in the run directory.
  SimulatedLines(std::string path, const Clock& clock) : path_(std::move(path)), clock_(clock) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override { socket_.Reset(); }
  // Connects again if the simulator was restarted. Returns false if there is no simulator.
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override;

 private:
  std::string path_;
  const Clock& clock_;
  Descriptor socket_;
};

// The end of the simulator.
class SimulatedLinesPort {
 public:
  SimulatedLinesPort() = default;
  ~SimulatedLinesPort();
  SimulatedLinesPort(const SimulatedLinesPort&) = delete;
  SimulatedLinesPort& operator=(const SimulatedLinesPort&) = delete;

  // Creates the socket, and replaces the socket of a process that has ended. The caller makes sure that no other process uses
  // the path. Only processes of this user can connect.
  [[nodiscard]] Result<> Listen(const std::string& path);
  // Readable while pulses wait.
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }
  // Returns the next pulse, or nothing. Drops datagrams that are not pulses.
  [[nodiscard]] std::optional<axlecast::Pulse> Next();

 private:
  std::string path_;
  Descriptor socket_;
};

}  // namespace axlecast
