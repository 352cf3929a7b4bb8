#pragma once

#include <memory>

#include "core/device/simulator.h"

namespace axlecast {
struct BusConfig;
class ConfigMap;
}  // namespace axlecast

namespace axlecast::saa_modbus {

// For Family::make_simulator: the encoders of the bus from its `simulate` mapping (README.md, "Simulation"). Null
// when a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeSaaModbusSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::saa_modbus
