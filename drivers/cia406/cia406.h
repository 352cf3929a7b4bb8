#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string_view>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/device/family.h"
#include "drivers/kit/simulation/simulated_can_node.h"

// Standard CANopen encoders (CiA 301, CiA 406): all that the family saa_can needs to know of its model `cia406`.
namespace axlecast::cia406 {

inline constexpr std::string_view kModel = "cia406";
[[nodiscard]] inline bool IsOwn(const DeviceConfig& device) {
  return device.settings != nullptr && device.settings->model == kModel;
}

// Reads the keys of one device whose `model` is cia406 (README.md, "Configuration"); the family has read that key.
// Errors go into the map's list; never null. can_filters is set.
[[nodiscard]] std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus);
// What the devices of this model on one bus must agree on: node ids, COB-IDs. Those of other models are left alone.
void CheckBus(ConfigMap& map, const BusConfig& bus);
// Whether it sends or is sent frames with this 11-bit identifier, so that the family can tell a clash between
// models.
[[nodiscard]] bool UsesId(const DeviceConfig& device, std::uint32_t id);

[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output);
// zero, set_position, read_position, read_identity, read_state, save_parameters. An order of another name is
// answered by REJECTED, REASON_UNKNOWN_OPERATION.
[[nodiscard]] std::span<const OperationSpec> Operations();

// The simulated encoder that stands for a configured one. `simulate`: the device's own keys there; its errors go
// into the map's list, and the node is made all the same.
[[nodiscard]] std::unique_ptr<SimulatedCanNode> MakeNode(const DeviceConfig& device, ConfigMap simulate);

// Returns one frame as the flat JSON object of docs/decode.md. `settings`: bits and turn_bits, node, cob_id; `model` is
// ignored. Fails for any other key and for a bad value.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, const CanFrame& frame);

}  // namespace axlecast::cia406
