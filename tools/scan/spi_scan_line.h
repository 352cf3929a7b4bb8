#pragma once

#include <memory>
#include <string>

#include "core/device/link.h"
#include "drivers/runtime/bus/serial_transactor.h"
#include "tools/scan/scan.h"

namespace axlecast {

// A spidev under a scan, or the socket of a simulated SPI bus.
class SpiScanLine final : public ScanLine {
 public:
  SpiScanLine(std::string path, const Clock& clock) : path_(std::move(path)), clock_(clock) {}

  // Empty, or the cause and the remedy.
  [[nodiscard]] std::string Open() { return OpenWith({.mode = 2, .clock_hz = 100'000}); }
  [[nodiscard]] bool Set(const ProbeTrial& trial) override { return OpenWith(trial.spi).empty(); }
  [[nodiscard]] Transactor& medium() override { return *medium_; }

 private:
  [[nodiscard]] std::string OpenWith(const SpiSettings& settings);

  const std::string path_;
  const Clock& clock_;
  std::unique_ptr<ByteLink> link_;
  std::unique_ptr<SerialTransactor> medium_;
};

}  // namespace axlecast
