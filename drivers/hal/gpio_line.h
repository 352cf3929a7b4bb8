#pragma once

#include <memory>
#include <vector>

#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"

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

  [[nodiscard]] std::string Open() override;
  void Close() override;
  // Spins through the last 100 us of `low`, sleeps before.
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override;

 private:
  class Line;

  [[nodiscard]] std::string Claim(const PulseLineConfig& config);

  std::vector<PulseLineConfig> lines_;
  const Clock& clock_;
  std::vector<std::unique_ptr<Line>> claimed_;  // in the order of lines_
};

}  // namespace axlecast
