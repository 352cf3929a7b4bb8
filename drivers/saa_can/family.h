#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "core/device/device.h"
#include "core/device/family.h"
#include "core/device/operation.h"
#include "core/device/probe.h"

// The functions of saa_can that the runtime reaches through Family and FamilyProbes.
namespace axlecast::saa_can {

// For Family::decode: decodes one frame, as its packet (core/device/can.h), to the flat JSON object of docs/decode.md.
// With `model=cia406`, the frame is that of a standard encoder.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes packet);

// Returns the operations of SAA encoders.
[[nodiscard]] std::span<const OperationSpec> SaaOperations();
// Returns the operations of the family: those of SAA encoders, then those that only cia406 has.
[[nodiscard]] std::span<const OperationSpec> Operations();
// Returns whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);

// For Family::make_device, for devices of every model.
[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output, SecretSource& secrets);

}  // namespace axlecast::saa_can

namespace axlecast {

[[nodiscard]] const Family& saa_can_family();
// Listens to a CAN bus: positions of SAA encoders on 1NN, heartbeats and process data of CANopen nodes. Sends nothing, so
// it works on an interface that only listens.
[[nodiscard]] std::vector<ProbeTrial> saa_can_probe(const ProbeScope& scope);

}  // namespace axlecast
