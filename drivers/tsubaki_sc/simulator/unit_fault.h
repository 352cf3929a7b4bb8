#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/kit/simulation/simulated_fault.h"

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

}  // namespace axlecast::tsubaki_sc::simulator
