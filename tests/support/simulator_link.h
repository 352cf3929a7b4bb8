#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/device/link.h"
#include "core/device/simulator.h"
#include "tests/support/cable.h"
#include "tests/support/fake_clock.h"

namespace axlecast {

// A line in virtual time to a simulator: reading and sleeping move the FakeClock from one thing that happens to the
// next, on either side.
class SimulatorLink final : public ByteLink, public PulseLines, public Cable {
 public:
  SimulatorLink(FakeClock& clock, Simulator& simulator, std::int64_t baud)
      : clock_(clock), simulator_(simulator), baud_(baud) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override { open_ = false; }
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] bool SetBaud(std::int64_t baud) override;
  [[nodiscard]] bool Write(Bytes bytes) override;
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override;
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override;
  [[nodiscard]] Status Wait(MonoNs until) override;
  void Wake() override {}
  [[nodiscard]] LineErrors Errors() const override { return {}; }
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override;

 private:
  [[nodiscard]] bool Gone() const { return !open_ || !plugged(); }
  [[nodiscard]] Simulator::Transmit Receive();
  void RunUntil(MonoNs until);

  FakeClock& clock_;
  Simulator& simulator_;
  std::int64_t baud_;
  bool open_ = false;
  std::vector<std::uint8_t> received_;
};

}  // namespace axlecast
