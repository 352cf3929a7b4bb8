#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/result.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"
#include "drivers/tsubaki_sc/simulator/sc_unit.h"

namespace axlecast {
struct BusConfig;
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

}  // namespace axlecast::tsubaki_sc::simulator

namespace axlecast::tsubaki_sc {

// For Family::make_simulator: all units of the bus, `units` by name and slave address, from the bus's `simulate`
// mapping (README.md of this folder). Null when a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeSimulator(const BusConfig& bus, ConfigMap& simulate,
                                                       std::span<const std::pair<std::string, std::uint8_t>> units);

}  // namespace axlecast::tsubaki_sc
