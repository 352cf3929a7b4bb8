#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"
#include "core/device/simulator.h"

// The functions of tformat that the runtime reaches through Family and FamilyProbes.
namespace axlecast::tformat {

// For Family::make_device.
[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output);

// One captured T-format frame, request or reply, as the object that docs/decode.md describes: Family::decode.
// Settings, later ones win: `bits` 1..24 (single-turn, default 17), `turn_bits` 0..24 (multi-turn, default 16),
// `enid` 0..255 or 0x00..0xff (the encoder ID that must answer; default any), `model` (all three of a known model).
//
// A single frame comes without its request: it is checked as the reply to the request that its own control field names.
// Therefore an echo error is never found here.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);

// For Family::make_simulator: the simulator of the bus's one encoder from the bus's `simulate` mapping
// (docs/simulation.md). Null when a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeTFormatSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::tformat

namespace axlecast {

[[nodiscard]] const Family& tformat_family();
[[nodiscard]] std::vector<ProbeTrial> tformat_probe(const ProbeScope& scope);

}  // namespace axlecast
