#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/kit/simulation/script.h"
#include "drivers/tsubaki_sc/simulator/sc_unit.h"
#include "drivers/tsubaki_sc/simulator/unit_fault.h"

namespace axlecast::tsubaki_sc::simulator {

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

}  // namespace axlecast::tsubaki_sc::simulator
