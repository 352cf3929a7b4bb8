#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/device/family.h"
#include "drivers/kit/simulation/simulated_can_node.h"

// Standard CANopen encoders (CiA 301, CiA 406): all that the family saa_can needs of its model `cia406`.
namespace axlecast::cia406 {

inline constexpr std::string_view kModel = "cia406";
[[nodiscard]] inline bool IsOwn(const DeviceConfig& device) {
  return device.settings != nullptr && device.settings->model == kModel;
}

// Reads the keys of one device whose `model` is cia406 (README.md, "Configuration"); the family has read that key.
// Errors go into the map's list; never null. can_filters is set.
[[nodiscard]] std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus);
// Checks that no two devices of this model on one bus share a node id or a COB-ID. Ignores devices of other models.
void CheckBus(ConfigMap& map, const BusConfig& bus);
// Returns whether the device sends or receives frames with this 11-bit identifier: two models must not share one.
[[nodiscard]] bool UsesId(const DeviceConfig& device, std::uint32_t id);

[[nodiscard]] std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device,
                                                 DeviceOutput& output);
// Returns zero, set_position, read_position, read_identity, read_state, save_parameters. A command of another name is
// rejected with REASON_UNKNOWN_OPERATION.
[[nodiscard]] std::span<const OperationSpec> Operations();

// Returns the alarms that an encoder can report: as Family::alarms.
[[nodiscard]] std::vector<AlarmSpec> Alarms();

// Returns the simulated encoder of a configured one. `simulate`: the device's own keys there. Errors go into the map's
// list; never null.
[[nodiscard]] std::unique_ptr<SimulatedCanNode> MakeNode(const DeviceConfig& device, ConfigMap simulate);

// Returns one frame as the flat JSON object of docs/decode.md. `settings`: bits and turn_bits, node, cob_id; `model` is
// ignored. Fails for any other key and for a bad value.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, const CanFrame& frame);

}  // namespace axlecast::cia406
