#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/device/line_settings.h"
#include "drivers/kit/simulation/unit_simulator.h"
#include "drivers/saa_modbus/simulated_encoder.h"

namespace axlecast::saa_modbus {

// One encoder on the line, with its traffic since the start.
struct SaaModbusUnit : ScriptedDevice<SimulatedEncoder> {
  struct Counters {
    std::int64_t requests = 0;    // understood and carried out
    std::int64_t replies = 0;     // handed to the line, damaged or not
    std::int64_t ignored = 0;     // addressed to it, but not a request of the manual
    std::int64_t bad_crc = 0;     // frames, for any address
    std::int64_t noise = 0;       // frames at another baud rate
    std::int64_t unanswered = 0;  // by a fault
    std::int64_t collisions = 0;  // replies destroyed because another one transmitted
  };
  Counters counters;
};

// SAA encoders on one Modbus line, as in the manual's 5.1.7. A frame ends with 3.5 characters of silence. Bytes that
// come sooner after other traffic belong to that traffic. A frame is not answered if its CRC is wrong, if it is for
// another address, or if the manual does not define it. An encoder at another baud rate than the host's receives noise,
// and the host receives noise from it. Two encoders that answer at once destroy each other's replies. Time must not run
// backwards.
class SaaModbusSimulator final : public UnitSimulator<SaaModbusUnit> {
 public:
  struct Line {
    LineFormat format{.baud = 19'200};  // of the host, until OnBaud
    bool echo = false;                  // the adapter receives its own transmission
    bool paced = true;                  // frames take their time on the wire and need their pauses
  };

  SaaModbusSimulator(const Line& line, std::vector<SaaModbusUnit> units)
      : UnitSimulator(std::move(units)), line_(line) {}

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override;
  void OnBaud(std::int64_t baud) override;
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Transmit& transmit) override;

  [[nodiscard]] const SimulatedEncoder& encoder(std::size_t index) const { return units().at(index).device; }
  [[nodiscard]] const SaaModbusUnit::Counters& counters(std::size_t index) const {
    return units().at(index).counters;
  }
  // Host frames that came sooner than 3.5 characters after other traffic.
  [[nodiscard]] std::int64_t short_gaps() const { return short_gaps_; }

 private:
  struct Pending {
    std::size_t unit = 0;
    Interval on_wire;
    MonoNs due = kNever;  // the host gets it
    std::int64_t baud = 0;
    Frame bytes;
    bool destroyed = false;
  };
  struct Answer {
    Frame bytes;
    std::int64_t baud = 0;
  };

  [[nodiscard]] CounterList CountersOf(const SaaModbusUnit& unit) const override;
  [[nodiscard]] MonoNs WireTime(std::size_t characters, std::int64_t baud) const;
  [[nodiscard]] MonoNs Gap() const;
  void FinishFrame(MonoNs now, const Transmit& transmit);
  void Receive(std::size_t index, MonoNs end, MonoNs now);
  [[nodiscard]] std::optional<Answer> Execute(SaaModbusUnit& unit, Bytes frame, MonoNs at);
  void Reply(std::size_t index, const Answer& answer, MonoNs request_end);
  void Collide(Pending& added);
  void SendDue(MonoNs now, const Transmit& transmit);

  Line line_;
  std::optional<std::int64_t> host_baud_;  // the last OnBaud
  Frame frame_;                            // of the host, so far
  bool frame_bad_ = false;                 // it ran into other traffic
  MonoNs frame_ends_ = kNever;             // with its silence
  MonoNs busy_until_ = 0;                  // last character on the wire, of any sender
  std::vector<Pending> pending_;
  LateAdapter adapter_;
  std::int64_t short_gaps_ = 0;
};

}  // namespace axlecast::saa_modbus
