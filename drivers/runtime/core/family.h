#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/runtime/core/device.h"
#include "drivers/runtime/core/simulator.h"

namespace axlecast {

struct BusConfig;
struct DeviceConfig;
class ConfigMap;

// What a family knows of a configured device: filled by Family::parse, extended by the family with its own keys.
struct DeviceSettings {
  virtual ~DeviceSettings() = default;

  std::string model;
  std::int64_t counts_per_turn = 0;  // single-turn resolution
  std::int64_t turns_range = 0;      // distinct multi-turn values; 0: single-turn only
  bool ccw_increases = true;         // counts rise counter-clockwise, seen from the shaft end
  double max_speed_rpm = 0;          // of the model
  double max_accel_rad_s2 = 0;       // of the model
  std::int64_t noise_counts = 0;     // error between two readings at rest, peak
  MonoNs wire_time = 0;              // shortest time of one live reading on the wire
};

// What an offline decode needs: `--set key=value` pairs.
using DecodeSettings = std::vector<std::pair<std::string, std::string>>;

// All that the rest of the product knows of a family of devices. One folder exports one.
struct Family {
  std::string_view name;     // as in the configuration
  std::string_view summary;  // one line for --help
  std::int64_t default_baud = 0;
  std::size_t max_devices_per_bus = 1;
  std::span<const OperationSpec> operations;

  // Reads the family's own keys of one device; errors go into the map's list. Never null.
  std::unique_ptr<DeviceSettings> (*parse)(ConfigMap& device) = nullptr;
  std::unique_ptr<Device> (*make_device)(const BusConfig& bus, const DeviceConfig& device,
                                         DeviceOutput& output) = nullptr;
  // Simulates all devices of the bus; reads the bus's `simulate` keys (checked by check-config too).
  // Null when a key is wrong: the errors are in the map's list.
  std::unique_ptr<Simulator> (*make_simulator)(const BusConfig& bus, ConfigMap& simulate) = nullptr;

  // One captured frame, request or reply, as the flat JSON object of docs/decode.md. False in *usable when
  // `settings` holds an unknown key or a bad value; the object then names it under "error".
  nlohmann::ordered_json (*decode)(const DecodeSettings& settings, Bytes frame, bool* usable) = nullptr;
};

// Every family that was built, by folder name. Defined by the build (cmake/axlecast.cmake).
[[nodiscard]] std::span<const Family* const> Families();
[[nodiscard]] const Family* FindFamily(std::string_view name);

}  // namespace axlecast
