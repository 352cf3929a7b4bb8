#pragma once

#include <span>
#include <string>

#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "drivers/hal/line_reader.h"
#include "drivers/hal/simulated_port.h"

namespace axlecast {

// A simulated SPI bus: a socket as in simulated_port.h, <bus>.spi in the run directory, protocol "axlecast-spi-1".
//   host      one packet per transfer: mode, 1 byte (0 to 3; the devices refuse others); bits per word, 1 byte; clock, Hz,
//             4 bytes, most significant first; then the bytes clocked out, 1 to kMaxFrame
//   simulator one packet for each transfer: the same number of bytes, clocked in
// The simulator answers at once, for the time at which the packet came: the first clock edge. After the answer, the host waits
// for the duration of the clocks.

// The end of the driver.
class SimulatedSpi final : public ClockedLink {
 public:
  // `path`: of the socket of the simulator. `settings`: of every Write.
  SimulatedSpi(std::string path, SpiSettings settings, const Clock& clock)
      : ClockedLink(std::move(path), settings, clock) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return socket_.IsConnected(); }
  // Clocks the bytes out. The bytes clocked in can be read afterwards.
  [[nodiscard]] bool Write(Bytes bytes) override;
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override;
  [[nodiscard]] Status Wait(MonoNs until) override;

  // Performs one transfer with its own settings. `rx` has the length of transfer.tx. Returns false if the simulator has ended, or
  // has not answered within a second: call Close and Open again.
  [[nodiscard]] bool Transfer(const SpiTransfer& transfer, std::span<std::uint8_t> rx);

 private:
  SimulatedSocket socket_;
};

// The end of the simulator.
class SimulatedSpiPort final : public SimulatedPort {
 public:
  SimulatedSpiPort(std::string path, Simulator& simulator, const Clock& clock)
      : SimulatedPort(simulator, clock), path_(std::move(path)) {}

  [[nodiscard]] Result<> Plug() override;
  void Unplug() override { socket_.Close(); }
  [[nodiscard]] bool HasHost() const override { return socket_.HasHost(); }
  [[nodiscard]] int FileDescriptor() const override { return socket_.FileDescriptor(); }
  [[nodiscard]] MonoNs NextDue() const override { return kNever; }
  void Serve() override;
  void Transmit(Bytes) override {}  // a device on SPI sends only while it is clocked

 private:
  [[nodiscard]] std::int64_t Baud() const override { return 0; }
  [[nodiscard]] bool Take(Bytes packet);

  const std::string path_;
  SimulatedSocketPort socket_;
};

}  // namespace axlecast
