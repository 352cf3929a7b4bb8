#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/kit/simulation/script.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/tsubaki_sc/simulator/sc_unit.h"

namespace axlecast::tsubaki_sc::simulator {

// What can be wrong with a simulated unit or its line: the faults of every simulated device, and those of Modbus.
struct UnitFault {
  SimulatedFault line;
  std::uint8_t wrong_address = 0;  // answers carry this address; 0: the right one
  std::uint8_t exception = 0;      // every command is answered with this error code and not carried out; 0: none
};

// "wrong_address:7", "exception:4", or a SimulatedFault. Empty when parsed, else what would be right.
[[nodiscard]] std::string ParseUnitFault(std::string_view text, UnitFault& fault);
[[nodiscard]] std::string UnitFaultText(const UnitFault& fault);

// All that a file, a script or a person can set of a simulated unit, its motor and its line.
struct SimulatedUnit final : SimulatedDevice {
  explicit SimulatedUnit(std::uint64_t seed) : unit(seed) {}

  void Advance(MonoNs now) override { unit.Advance(now); }
  [[nodiscard]] Result<> Set(std::string_view name, std::string_view value) override;  // of QuantityNames()

  ScUnit unit;
  UnitFault fault;
};

// The names that SimulatedUnit::Set takes, in the order in which a mapping of several is applied.
[[nodiscard]] const std::vector<std::string_view>& QuantityNames();

// Every quantity with its present value (at unit.now()), then the registers of interest and what was done to the
// unit. Never a password.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> Quantities(const SimulatedUnit& simulated);

// Appends the registers of interest and what was done to the unit, as README.md lists them. Never a password.
void AddReport(const ScUnit& unit, std::vector<std::pair<std::string, std::string>>& list);

}  // namespace axlecast::tsubaki_sc::simulator
