#pragma once

#include <memory>

#include "core/device/simulator.h"

namespace axlecast {
struct BusConfig;
class ConfigMap;
}  // namespace axlecast

namespace axlecast::tformat {

// For Family::make_simulator: the simulator of the bus's one encoder from the bus's `simulate` mapping
// (docs/simulation.md). Null when a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeTFormatSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::tformat
