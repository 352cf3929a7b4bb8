#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "core/device/simulator.h"

namespace axlecast {
struct BusConfig;
class ConfigMap;
}  // namespace axlecast

namespace axlecast::tsubaki_sc {

// For Family::make_simulator: all units of the bus, `units` by name and slave address, from the bus's `simulate`
// mapping (README.md of this folder). Null when a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeSimulator(const BusConfig& bus, ConfigMap& simulate,
                                                       std::span<const std::pair<std::string, std::uint8_t>> units);

}  // namespace axlecast::tsubaki_sc
