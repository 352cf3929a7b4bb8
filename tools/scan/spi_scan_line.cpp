#include "tools/scan/spi_scan_line.h"

#include <filesystem>

#include "drivers/hal/simulated_spi.h"
#include "drivers/hal/spi_port.h"

namespace axlecast {

std::string SpiScanLine::OpenWith(const SpiSettings& settings) {
  medium_.reset();
  link_.reset();  // before the new one takes the lock
  std::error_code ignored;
  if (std::filesystem::is_socket(path_, ignored)) {
    link_ = std::make_unique<SimulatedSpi>(path_, settings, clock_);
  } else {
    link_ = std::make_unique<SpiPort>(path_, settings, clock_);
  }
  medium_ = std::make_unique<SerialTransactor>(*link_, clock_, false, nullptr);
  return link_->Open();
}

}  // namespace axlecast
