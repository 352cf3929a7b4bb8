#pragma once

#include <string>

#include "drivers/hal/serial_port.h"
#include "drivers/runtime/bus/serial_transactor.h"
#include "tools/scan/scan.h"

namespace axlecast {

// A serial port or pty under a scan: locked as by a driver, kept open through all rates.
class SerialScanLine final : public ScanLine {
 public:
  SerialScanLine(const std::string& path, bool echo, const Clock& clock);

  // Empty, or the cause and the remedy; names who holds the port.
  [[nodiscard]] std::string Open();
  [[nodiscard]] bool Set(const ProbeTrial& trial) override;
  [[nodiscard]] Transactor& medium() override { return medium_; }

 private:
  std::string path_;
  SerialPort port_;
  SerialTransactor medium_;
};

}  // namespace axlecast
