#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"
#include "core/device/simulator.h"

// The functions of Family (core/device/family.h) and what the tests need. README.md describes settings and keys.
namespace axlecast::tformat {

[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output);
// A frame is checked as the reply to the request that its own control field names, so that no echo error is found.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);
[[nodiscard]] std::unique_ptr<Simulator> MakeTFormatSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::tformat

namespace axlecast {

[[nodiscard]] const Family& tformat_family();
[[nodiscard]] std::vector<ProbeTrial> tformat_probe(const ProbeScope& scope);

}  // namespace axlecast
