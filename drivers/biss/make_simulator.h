#pragma once

#include <memory>

#include "core/device/simulator.h"

namespace axlecast {
struct BusConfig;
class ConfigMap;
}  // namespace axlecast

namespace axlecast::biss {

// For Family::make_simulator: the encoder of the bus from its `simulate` mapping (README.md, "Simulation"). Null when
// a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeBissSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::biss
