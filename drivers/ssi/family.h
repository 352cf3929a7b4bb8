#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"
#include "core/device/simulator.h"
#include "drivers/ssi/codec.h"

// The functions of Family (core/device/family.h) and what the tests need. README.md describes settings and keys.
namespace axlecast::ssi {

[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output);
// Returns the fault of the line if consecutive transfers fail in the same way; null if they do not indicate one.
[[nodiscard]] const AlarmSpec* LineAlarm(WordError error);
[[nodiscard]] std::vector<AlarmSpec> Alarms(const DeviceConfig& device);
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);
[[nodiscard]] std::unique_ptr<Simulator> MakeSsiSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::ssi

namespace axlecast {

[[nodiscard]] const Family& ssi_family();
[[nodiscard]] std::vector<ProbeTrial> ssi_probe(const ProbeScope& scope);

}  // namespace axlecast
