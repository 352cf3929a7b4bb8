#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"
#include "drivers/tsubaki_sc/simulator/sc_unit.h"

namespace axlecast {
struct BusConfig;
class ConfigMap;
}  // namespace axlecast

namespace axlecast::tsubaki_sc::simulator {

// What can be wrong with a simulated unit or its line: the faults of every simulated device, and those of Modbus.
struct UnitFault {
  SimulatedFault line;
  std::uint8_t wrong_address = 0;  // replies carry this address; 0: the right one
  std::uint8_t exception = 0;      // every command is answered with this error code and not carried out; 0: none

  // Parses "wrong_address:7", "exception:4", or a SimulatedFault.
  [[nodiscard]] static Result<UnitFault> Parse(std::string_view text);
};

// All that a file, a script or an operator can set of a simulated unit, its motor and its line.
struct SimulatedUnit final : TableDevice<SimulatedUnit> {
  explicit SimulatedUnit(std::uint64_t seed) : unit(seed) {}

  void Advance(MonoNs now) override { unit.Advance(now); }
  [[nodiscard]] static const QuantityTable<SimulatedUnit>& Table();
  // Every quantity with its present value, then the registers of interest and what was done to the unit, as README.md
  // lists them. Never a password.
  [[nodiscard]] QuantityList Quantities() const;

  ScUnit unit;
  UnitFault fault;
};

// How strict the line is.
struct LineRules {
  // The interval that must be at least 0.1 s; guideline 3 does not define it.
  enum class Reading : std::uint8_t {
    kA,     // on the whole bus, from the end of the response
    kL,     // on the whole bus, from the end of the command
    kW,     // of each unit for itself, from the end of its response
    kNone,  // not at all
  };
  Reading reading = Reading::kA;
  bool paced = true;                      // false: no wire time, and a command ends with its last byte
  MonoNs reply_delay = 5 * kMillisecond;  // between command and response, at least the silent interval
  MonoNs tolerance = 2 * kMillisecond;    // of reading L: how late the host's bytes may reach us
  bool echo = false;                      // the adapter receives its own transmission
};

// One unit on the bus.
struct Station : ScriptedDevice<SimulatedUnit> {
  std::uint8_t address = 1;
  SeededRandom random;       // of its faults
  MonoNs ready = INT64_MIN;  // reading W

  struct Counters {
    std::int64_t commands = 0;  // carried out or refused, broadcasts too
    std::int64_t broadcasts = 0;
    std::int64_t writes = 0;               // that would change something, carried out or refused
    std::int64_t responses = 0;            // handed to the line, damaged or not
    std::array<std::int64_t, 5> errors{};  // answered, by error code
    std::int64_t dropped_early = 0;        // sooner than 0.1 s
    std::int64_t dropped_line = 0;         // damaged on its way to this unit
    std::int64_t unanswered = 0;           // off, or by a fault
  };
  Counters counters = {};
};

// Up to 16 SC units on one RS-485 line, 9600 8E1, as strict as guideline 3 and 4. A command ends after 5 ms of silence.
// Its response is handed over when its last bit would end on the wire. Time must not run backwards.
class BusSimulator final : public UnitSimulator<Station> {
 public:
  BusSimulator(std::vector<Station> stations, const LineRules& rules)
      : UnitSimulator(std::move(stations)), rules_(rules) {}

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override;
  void OnBaud(std::int64_t baud) override { baud_fits_ = baud == 9600; }
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Transmit& transmit) override;

  // What no unit executed, since the start.
  struct Counters {
    std::int64_t dropped_gap = 0;       // a command that stopped half-way for 5 ms or longer
    std::int64_t dropped_checksum = 0;  // error check mismatch
    std::int64_t dropped_silence = 0;   // less than 5 ms after the frame before it, or run together with another
    std::int64_t dropped_baud = 0;      // bytes at another rate
    std::int64_t foreign = 0;           // for an address that no unit has
    std::int64_t collisions = 0;        // two transmitted at once
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Response {
    Interval on_wire;
    MonoNs due = 0;  // the host gets it
    std::vector<std::uint8_t> bytes;
  };

  void CatchUp(MonoNs now) override;
  [[nodiscard]] CounterList CountersOf(const Station& station) const override;
  [[nodiscard]] MonoNs WireTime(std::size_t bytes) const;
  void BeginFrame(MonoNs now);
  void FinishFrame(MonoNs now, const Transmit& transmit);
  [[nodiscard]] bool CountBroken();
  void Take(Bytes frame, MonoNs now, const Transmit& transmit);
  [[nodiscard]] bool TooEarly(const Station& station) const;
  void Offer(Station& station, Bytes frame, MonoNs now, const Transmit& transmit);
  void Respond(Station& station, std::vector<std::uint8_t> response, MonoNs now, const Transmit& transmit);
  bool Collide(const Interval& with);
  void SendDue(MonoNs now, const Transmit& transmit);

  LineRules rules_;
  Counters counters_;
  bool baud_fits_ = true;
  MonoNs next_look_ = 0;

  std::vector<std::uint8_t> frame_;  // of the command so far
  Interval frame_at_;                // on the wire
  MonoNs frame_ends_ = kNever;       // it is complete if no byte comes before
  bool run_together_ = false;        // without silence before it
  bool collided_ = false;
  MonoNs quiet_since_ = INT64_MIN / 2;
  MonoNs ready_ = INT64_MIN;  // readings A and L
  std::vector<Response> responses_;
  LateAdapter adapter_;
};

}  // namespace axlecast::tsubaki_sc::simulator

namespace axlecast::tsubaki_sc {

// For Family::make_simulator: all units of the bus, `units` by name and slave address, from the bus's `simulate`
// mapping (README.md of this folder). Null when a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeSimulator(const BusConfig& bus, ConfigMap& simulate,
                                                       std::span<const std::pair<std::string, std::uint8_t>> units);

}  // namespace axlecast::tsubaki_sc
