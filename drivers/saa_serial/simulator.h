#pragma once

#include <cstdint>
#include <vector>

#include "drivers/kit/simulation/unit_simulator.h"
#include "drivers/saa_serial/simulated_encoder.h"

namespace axlecast::saa_serial {

// One encoder on the line.
struct SaaUnit : ScriptedDevice<SimulatedEncoder> {
  std::uint8_t control = 0;  // BX
  int zero = -1;             // CX; -1: a variant without zero clearing
};

// The encoders on one line, in one of the maker's modes (SAA manual 5.1.1 to 5.1.6), written from the manual alone.
// It drops what a real encoder would drop: CLK pulses that are too short, or that come while it still works on the
// one before; commands of no encoder; all that is sent while an encoder transmits. The instants given to it must not
// run backwards.
class SaaSimulator final : public UnitSimulator<SaaUnit> {
 public:
  enum class Mode : std::uint8_t { kTiming, kHandshake, kBus };

  struct Setup {
    Mode mode = Mode::kBus;
    int clk = -1;                     // index of the CLK line; -1: none
    int clr = -1;                     // of the CLR line
    MonoNs refresh = kMillisecond;    // timing: T3 of 5.1.1
    MonoNs character = kMillisecond;  // on the wire
    bool echo = false;                // the adapter receives its own transmission
    std::int64_t baud = 0;            // of the encoders; 0: whatever the host's is
  };

  SaaSimulator(const Setup& setup, std::vector<SaaUnit> units) : UnitSimulator(std::move(units)), setup_(setup) {}

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override;
  void OnBaud(std::int64_t baud) override { baud_fits_ = setup_.baud == 0 || baud == setup_.baud; }
  void OnPulse(std::uint8_t line, MonoNs low, MonoNs now, const Transmit& transmit) override;
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Transmit& transmit) override;

  // Traffic since the start.
  struct Counters {
    std::int64_t requests = 0;      // control commands and CLK pulses that were taken
    std::int64_t frames = 0;        // handed to the line, damaged or not
    std::int64_t unanswered = 0;    // off, without power, or by a fault
    std::int64_t unknown = 0;       // bytes and commands that mean nothing to any encoder
    std::int64_t collisions = 0;    // bytes sent while an encoder transmits
    std::int64_t short_pulses = 0;  // on CLK or CLR, below 10 us
    std::int64_t fast_pulses = 0;   // on CLK, while the encoder still works on the last one
    std::int64_t noise = 0;         // bytes at another baud rate
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const SimulatedEncoder& encoder(std::size_t unit) const { return units()[unit].device; }

 private:
  struct Pending {
    MonoNs due = 0;            // the host gets it
    MonoNs on_wire_until = 0;  // the encoder has sent it
    std::vector<std::uint8_t> bytes;
  };

  void CatchUp(MonoNs now) override;
  [[nodiscard]] CounterList CountersOf(const SaaUnit& unit) const override;
  void Stream(MonoNs now);
  void TakeByte(std::uint8_t byte, MonoNs now);
  void Execute(std::uint8_t command, MonoNs at);
  // The frame of a position sampled at `at`, sent from then on.
  void Answer(SaaUnit& unit, MonoNs at, MonoNs now);
  [[nodiscard]] std::vector<std::uint8_t> FrameOf(SaaUnit& unit, MonoNs at);
  void SendDue(MonoNs now, const Transmit& transmit);
  [[nodiscard]] MonoNs RefreshPeriod() const;

  Setup setup_;
  Counters counters_;
  bool baud_fits_ = true;
  std::vector<std::uint8_t> request_;
  MonoNs next_frame_ = kNever;  // timing
  MonoNs busy_until_ = INT64_MIN;
  std::vector<Pending> pending_;
  LateAdapter adapter_;
};

}  // namespace axlecast::saa_serial
