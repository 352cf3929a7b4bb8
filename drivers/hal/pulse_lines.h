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

// Real output lines, through libgpiod. A pulse is never shorter than asked for; under load it may be longer.
//
// The kernel hands the lines back when the process ends, however it ends, also in the middle of a pulse. What a line
// does then is its controller's affair: most turn it into an input or leave it as it was driven last. So a line whose
// low level acts (CLR sets a zero) needs an external pull-up, and a device that tolerates one pulse cut short.
class GpioLines final : public PulseLines {
 public:
  GpioLines(std::vector<PulseLineConfig> lines, const Clock& clock);
  ~GpioLines() override;
  GpioLines(const GpioLines&) = delete;
  GpioLines& operator=(const GpioLines&) = delete;

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  // Spins through the last 100 us of `low`, sleeps before.
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override;

 private:
  class Line;

  [[nodiscard]] Result<> Claim(const PulseLineConfig& config);

  std::vector<PulseLineConfig> lines_;
  const Clock& clock_;
  std::vector<std::unique_ptr<Line>> claimed_;  // in the order of lines_
};

// The lines beside a simulated bus: each pulse goes as one datagram to the bus's simulator, when it ends.
class SimulatedLines final : public PulseLines {
 public:
  // `path`: where the simulator listens, <bus>.lines in the run directory.
  SimulatedLines(std::string path, const Clock& clock) : path_(std::move(path)), clock_(clock) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override { socket_.Reset(); }
  // False when no simulator is there to see it. One that was started anew meanwhile is found.
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override;

 private:
  std::string path_;
  const Clock& clock_;
  Descriptor socket_;
};

// The simulator's end.
class SimulatedLinesPort {
 public:
  SimulatedLinesPort() = default;
  ~SimulatedLinesPort();
  SimulatedLinesPort(const SimulatedLinesPort&) = delete;
  SimulatedLinesPort& operator=(const SimulatedLinesPort&) = delete;

  // Takes the path over from a process that has gone; whoever calls makes sure that none lives. The error
  // contains the cause and the remedy. Only this user's processes reach it.
  [[nodiscard]] Result<> Listen(const std::string& path);
  // Readable when a pulse has come.
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }
  // The next pulse; none when nothing has come. What is no pulse is dropped.
  [[nodiscard]] std::optional<axlecast::Pulse> Next();

 private:
  std::string path_;
  Descriptor socket_;
};

}  // namespace axlecast
