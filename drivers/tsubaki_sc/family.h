#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/device/family.h"
#include "core/device/probe.h"

// The functions of tsubaki_sc that the runtime reaches through Family and FamilyProbes.
namespace axlecast::tsubaki_sc {

// For Family::make_device.
[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output, SecretSource& secrets);

// For Family::decode: one captured frame of an SC unit's line as the object that README.md describes. Settings, of which
// later ones win:
//   start    0..65535 or 0x..: the first address that was read; the reply to a read does not contain it
//   request  the request in hex: the same, and the reply is checked against it
//   endian   high (default), low: which half of a register holds the first of its two characters
// The registers of a login and of the password are always masked, and so are eight holding registers whose addresses
// are not known.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);

}  // namespace axlecast::tsubaki_sc

namespace axlecast {

[[nodiscard]] const Family& tsubaki_sc_family();
[[nodiscard]] std::vector<ProbeTrial> tsubaki_sc_probe(const ProbeScope& scope);

}  // namespace axlecast
