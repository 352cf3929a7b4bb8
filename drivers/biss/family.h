#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"
#include "core/device/simulator.h"

// The functions of Family (core/device/family.h) and what the tests need. README.md describes settings and keys.
namespace axlecast::biss {

[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output, SecretSource& secrets);
[[nodiscard]] std::span<const OperationSpec> Operations();
[[nodiscard]] std::vector<AlarmSpec> Alarms();
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);
[[nodiscard]] std::unique_ptr<Simulator> MakeBissSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::biss

namespace axlecast {

[[nodiscard]] const Family& biss_family();
[[nodiscard]] std::vector<ProbeTrial> biss_probe(const ProbeScope& scope);

}  // namespace axlecast
