#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.h"

namespace axlecast {

// One output line beside the bus (a GPIO), idle high, known to the device by its place in FamilyBus::lines.
struct PulseLineConfig {
  std::string name;  // as the family calls it, e.g. "clk"
  std::string chip;  // e.g. /dev/gpiochip0
  int offset = 0;    // of the line on its chip
};

// Output lines beside a bus. drivers/hal/gpio_line.h drives real ones.
class PulseLines {
 public:
  virtual ~PulseLines() = default;

  // Claims all lines and drives them high; an empty string when done, else the cause and the remedy.
  [[nodiscard]] virtual std::string Open() = 0;
  virtual void Close() = 0;
  // Drives the line low for at least `low`, then high again. False when that could not be done.
  [[nodiscard]] virtual bool Pulse(std::uint8_t line, MonoNs low) = 0;
};

}  // namespace axlecast
