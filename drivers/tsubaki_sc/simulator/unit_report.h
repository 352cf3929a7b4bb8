#pragma once

#include <string>
#include <utility>
#include <vector>

#include "drivers/tsubaki_sc/simulator/sc_unit.h"

namespace axlecast::tsubaki_sc::simulator {

// Appends the registers of interest and what was done to the unit, as README.md lists them. Never a password.
void AddReport(const ScUnit& unit, std::vector<std::pair<std::string, std::string>>& list);

}  // namespace axlecast::tsubaki_sc::simulator
