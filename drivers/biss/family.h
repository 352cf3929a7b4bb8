#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"
#include "core/device/simulator.h"

// The functions of biss that the runtime reaches through Family and FamilyProbes.
namespace axlecast::biss {

// For Family::make_device.
[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output, SecretSource& secrets);

[[nodiscard]] std::span<const OperationSpec> Operations();

// For Family::decode; README.md, "Decoding", describes the object.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);

// For Family::make_simulator: the encoder of the bus from its `simulate` mapping (README.md, "Simulation"). Null when
// a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeBissSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::biss

namespace axlecast {

[[nodiscard]] const Family& biss_family();
[[nodiscard]] std::vector<ProbeTrial> biss_probe(const ProbeScope& scope);

}  // namespace axlecast
