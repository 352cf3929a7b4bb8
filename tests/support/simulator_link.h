#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "drivers/runtime/core/byte_link.h"
#include "drivers/runtime/core/pulse_lines.h"
#include "drivers/runtime/core/simulator.h"
#include "tests/support/fake_clock.h"

namespace axlecast {

// A line in virtual time to a simulator: reading and sleeping move the FakeClock from one thing that happens to the
// next, on either side. With `damage`, what comes from the simulator passes through it first.
class SimulatorLink final : public ByteLink, public PulseLines {
 public:
  using Damage = std::function<void(std::vector<std::uint8_t>& bytes)>;

  SimulatorLink(FakeClock& clock, Simulator& simulator, std::int64_t baud)
      : clock_(clock), simulator_(simulator), baud_(baud) {}

  void SetDamage(Damage damage) { damage_ = std::move(damage); }
  void Unplug() { plugged_ = false; }
  void Plug() { plugged_ = true; }
  [[nodiscard]] std::int64_t writes() const { return writes_; }
  [[nodiscard]] std::int64_t waits() const { return waits_; }

  [[nodiscard]] std::string Open() override;
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
  [[nodiscard]] bool Gone() const { return !open_ || !plugged_; }
  [[nodiscard]] Simulator::Transmit Receive();
  void RunUntil(MonoNs until);

  FakeClock& clock_;
  Simulator& simulator_;
  std::int64_t baud_;
  Damage damage_;
  bool open_ = false;
  bool plugged_ = true;
  std::vector<std::uint8_t> received_;
  std::int64_t writes_ = 0;
  std::int64_t waits_ = 0;
};

}  // namespace axlecast
