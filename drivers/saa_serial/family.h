#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"
#include "core/device/simulator.h"

// The functions of Family (core/device/family.h) and what the tests need. README.md describes settings and keys.
namespace axlecast::saa_serial {

[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output, SecretSource& secrets);
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);
[[nodiscard]] std::unique_ptr<Simulator> MakeSaaSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::saa_serial

namespace axlecast {

[[nodiscard]] const Family& saa_serial_family();
[[nodiscard]] std::vector<ProbeTrial> saa_serial_probe(const ProbeScope& scope);

}  // namespace axlecast
