#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"
#include "core/device/simulator.h"

// The functions of saa_serial that the runtime reaches through Family and FamilyProbes.
namespace axlecast::saa_serial {

// For Family::make_device.
[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output, SecretSource& secrets);

// For Family::decode; README.md, "Decoding", describes the object.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);

// For Family::make_simulator: the encoders of the bus from its `simulate` mapping (README.md, "Simulation"). Null
// when a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeSaaSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::saa_serial

namespace axlecast {

[[nodiscard]] const Family& saa_serial_family();
[[nodiscard]] std::vector<ProbeTrial> saa_serial_probe(const ProbeScope& scope);

}  // namespace axlecast
