#pragma once

#include <string>

#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "core/device/simulator.h"
#include "drivers/hal/line_reader.h"
#include "tests/support/cable.h"
#include "tests/support/fake_clock.h"

namespace axlecast {

// An SPI bus in virtual time to a simulator: a transfer takes the time of its clocks. Damage changes what is clocked in;
// where it leaves nothing the line rests high.
class SimulatorSpiLink final : public ClockedLink, public Cable {
 public:
  SimulatorSpiLink(FakeClock& clock, Simulator& simulator, SpiSettings settings)
      : ClockedLink("", settings, clock), fake_clock_(clock), simulator_(simulator) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] bool Write(Bytes bytes) override;
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override;
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override;
  [[nodiscard]] Status Wait(MonoNs until) override;

 private:
  [[nodiscard]] bool Gone() const { return !open_ || !plugged(); }
  void RunUntil(MonoNs until);

  FakeClock& fake_clock_;
  Simulator& simulator_;
  bool open_ = false;
};

}  // namespace axlecast
