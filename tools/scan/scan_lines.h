#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/device/link.h"
#include "drivers/hal/can_netlink.h"
#include "drivers/hal/serial_port.h"
#include "drivers/runtime/bus/transactor.h"
#include "tools/scan/scan.h"

namespace axlecast {

// A serial port or pty under a scan: locked as by a driver, kept open through all rates.
class SerialScanLine final : public ScanLine {
 public:
  SerialScanLine(const std::string& path, bool echo, const Clock& clock);

  // The error contains the cause and the remedy, and names the process that holds the port.
  [[nodiscard]] Result<> Open();
  [[nodiscard]] bool Set(const ProbeTrial& trial) override;
  [[nodiscard]] Transactor& medium() override { return medium_; }

 private:
  std::string path_;
  SerialPort port_;
  SerialTransactor medium_;
};

// A spidev under a scan, or the socket of a simulated SPI bus.
class SpiScanLine final : public ScanLine {
 public:
  SpiScanLine(std::string path, const Clock& clock) : path_(std::move(path)), clock_(clock) {}

  // The error contains the cause and the remedy.
  [[nodiscard]] Result<> Open() { return OpenWith({.mode = 2, .clock_hz = 100'000}); }
  [[nodiscard]] bool Set(const ProbeTrial& trial) override { return OpenWith(trial.spi).has_value(); }
  [[nodiscard]] Transactor& medium() override { return *medium_; }

 private:
  [[nodiscard]] Result<> OpenWith(const SpiSettings& settings);

  const std::string path_;
  const Clock& clock_;
  std::unique_ptr<ByteLink> link_;
  std::unique_ptr<SerialTransactor> medium_;
};

// A CAN interface under a scan, which sends nothing on it. One that is up stays as it is. One that is down is set to each
// bit rate in turn, listening only, and set down and back at the end. The socket of a simulated bus is as one that is down.
class CanScanLine final : public ScanLine {
 public:
  CanScanLine(std::string interface, const Clock& clock) : interface_(std::move(interface)), clock_(clock) {}
  ~CanScanLine() override;
  CanScanLine(const CanScanLine&) = delete;
  CanScanLine& operator=(const CanScanLine&) = delete;

  // The error contains the cause and the remedy.
  [[nodiscard]] Result<> Open();
  [[nodiscard]] bool is_up() const { return found_.up; }
  [[nodiscard]] std::int64_t bitrate() const { return found_.bitrate; }  // 0: not told
  // Whether this process may set a bit rate: asked of the kernel, which changes nothing.
  [[nodiscard]] bool MayConfigure();
  // What to type, as root, so that it listens.
  [[nodiscard]] std::string ListenLine() const;

  [[nodiscard]] bool Set(const ProbeTrial& trial) override;
  [[nodiscard]] Transactor& medium() override { return *medium_; }

 private:
  [[nodiscard]] bool IsSimulated() const { return interface_.starts_with('/'); }
  [[nodiscard]] bool ListenAt(std::int64_t bitrate);

  const std::string interface_;
  const Clock& clock_;
  CanNetlink netlink_;
  CanInterface found_;        // as it was before
  bool touched_ = false;      // its settings are no longer those
  std::int64_t current_ = 0;  // that the socket is open at
  std::unique_ptr<FrameLink> link_;
  std::unique_ptr<CanTransactor> medium_;
};

// The trials at each of these rates, the first rate first.
[[nodiscard]] std::vector<PlannedTrial> AtBitrates(const std::vector<PlannedTrial>& plan,
                                                   const std::vector<std::int64_t>& bitrates);

// Those that CiA 301 names, the usual ones first.
[[nodiscard]] const std::vector<std::int64_t>& CanBitrates();

}  // namespace axlecast
