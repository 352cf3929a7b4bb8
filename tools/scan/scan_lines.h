#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/device/link.h"
#include "drivers/hal/can_netlink.h"
#include "drivers/hal/serial_port.h"
#include "drivers/runtime/bus/transactor.h"
#include "tools/scan/scan.h"

namespace axlecast {

// A serial port or pty. It is locked as by a driver, and stays open for all rates.
class SerialScanLine final : public ScanLine {
 public:
  SerialScanLine(const std::string& path, bool echo, const Clock& clock);

  // The error names the process that has the port open.
  [[nodiscard]] Result<> Open();
  [[nodiscard]] bool Set(const ProbeTrial& trial) override;
  [[nodiscard]] Transactor& transactor() override { return transactor_; }

 private:
  std::string path_;
  SerialPort port_;
  SerialTransactor transactor_;
};

// A spidev, or the socket of a simulated SPI bus.
class SpiScanLine final : public ScanLine {
 public:
  SpiScanLine(std::string path, const Clock& clock) : path_(std::move(path)), clock_(clock) {}

  [[nodiscard]] Result<> Open() { return OpenWith({.mode = 2, .clock_hz = 100'000}); }
  [[nodiscard]] bool Set(const ProbeTrial& trial) override { return OpenWith(trial.spi).has_value(); }
  [[nodiscard]] Transactor& transactor() override { return *transactor_; }

 private:
  [[nodiscard]] Result<> OpenWith(const SpiSettings& settings);

  const std::string path_;
  const Clock& clock_;
  std::unique_ptr<ByteLink> link_;
  std::unique_ptr<SerialTransactor> transactor_;
};

// A CAN interface. The scan transmits nothing on it. An interface that is up is not changed. An interface that is down is set
// to each bit rate in listen-only mode, and is restored at the end. The socket of a simulated bus counts as down.
class CanScanLine final : public ScanLine {
 public:
  CanScanLine(std::string interface, const Clock& clock) : interface_(std::move(interface)), clock_(clock) {}
  ~CanScanLine() override;
  CanScanLine(const CanScanLine&) = delete;
  CanScanLine& operator=(const CanScanLine&) = delete;

  [[nodiscard]] Result<> Open();
  [[nodiscard]] bool is_up() const { return found_.up; }
  [[nodiscard]] std::int64_t bitrate() const { return found_.bitrate; }  // 0: unknown
  // Returns whether this process may set a bit rate. Requests it from the kernel, without a change.
  [[nodiscard]] bool MayConfigure();
  // Returns the line that an operator types as root to receive on the interface.
  [[nodiscard]] std::string ListenLine() const;

  [[nodiscard]] bool Set(const ProbeTrial& trial) override;
  [[nodiscard]] Transactor& transactor() override { return *transactor_; }

 private:
  [[nodiscard]] bool IsSimulated() const { return interface_.starts_with('/'); }
  [[nodiscard]] bool ListenAt(std::int64_t bitrate);

  const std::string interface_;
  const Clock& clock_;
  CanNetlink netlink_;
  CanInterface found_;        // before the scan
  bool touched_ = false;      // the settings were changed
  std::int64_t current_ = 0;  // bit rate of the open socket
  std::unique_ptr<FrameLink> link_;
  std::unique_ptr<CanTransactor> transactor_;
};

// Returns the trials at each of these rates, in the order of the rates.
[[nodiscard]] std::vector<PlannedTrial> AtBitrates(const std::vector<PlannedTrial>& plan,
                                                   const std::vector<std::int64_t>& bitrates);

// Returns the bit rates of CiA 301, the most common ones first.
[[nodiscard]] const std::vector<std::int64_t>& CanBitrates();

}  // namespace axlecast
