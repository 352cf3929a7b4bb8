#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"

// The functions of saa_can that the runtime reaches through Family and FamilyProbes.
namespace axlecast::saa_can {

// For Family::decode: decodes one frame, as its packet (core/device/can.h), to the flat JSON object of docs/decode.md.
// With `model=cia406`, the frame is that of a standard encoder.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes packet);

}  // namespace axlecast::saa_can

namespace axlecast {

[[nodiscard]] const Family& saa_can_family();
// Listens to a CAN bus: positions of SAA encoders on 1NN, heartbeats and process data of CANopen nodes. Sends nothing, so
// it works on an interface that only listens.
[[nodiscard]] std::vector<ProbeTrial> saa_can_probe(const ProbeScope& scope);

}  // namespace axlecast
