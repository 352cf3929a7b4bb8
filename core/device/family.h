#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/secret.h"
#include "core/device/can.h"
#include "core/device/device.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "core/device/parameter.h"
#include "core/device/simulator.h"

namespace axlecast {

struct BusConfig;
struct DeviceConfig;
class ConfigMap;

// The settings of a configured device: filled by Family::parse. A family derives from it and adds its own keys.
struct DeviceSettings {
  virtual ~DeviceSettings() = default;

  std::string model;
  std::int64_t counts_per_turn = 0;  // single-turn resolution
  std::int64_t turns_range = 0;      // distinct multi-turn values; 0: single-turn only
  bool ccw_increases = true;         // counts rise counter-clockwise, seen from the shaft end
  double max_speed_rpm = 0;          // of the model
  double max_accel_rad_s2 = 0;       // of the model
  std::int64_t noise_counts = 0;     // error between two readings at rest, peak
  int confirmations_after_jump =
      3;                          // that agree on a place which the shaft cannot have reached, until it is believed
  bool holds_secrets = false;     // its process must not write core files
  std::int64_t write_budget = 0;  // rewrites of its memory that the maker allows in all; 0: none stated
  MonoNs wire_time = 0;           // shortest time of one live reading, with the pauses that the bus needs
  int exchanges = 1;              // of one live reading
  MonoNs reply_timeout = 0;       // of one exchange on a line where a reply may come late; 0: none can
  MonoNs latch_after = 0;         // from the begin of a request to the middle of the interval in which it samples
  MonoNs own_period = 0;          // of readings that it sends by itself; 0: each is requested
  CanFilters can_filters;         // kCan: the frames that it needs
  SpiSettings spi;                // kSpi: clock and mode
};

// The settings of a configured bus: filled by Family::parse_bus. A family derives from it and adds its own keys.
struct FamilyBus {
  virtual ~FamilyBus() = default;

  Pacing pacing;
  std::vector<PulseLineConfig> lines;  // output lines beside the bus
};

// Which of drivers/hal carries a family's frames.
enum class LinkKind : std::uint8_t {
  kSerial,  // an asynchronous line of bytes
  kModbus,  // Modbus RTU
  kCan,     // frames of classical CAN
  kSpi,     // one device on an SPI bus, which clocks it
};

// What an offline decode needs: `--set key=value` pairs.
using DecodeSettings = std::vector<std::pair<std::string, std::string>>;

// All that the rest of the product knows of a family of devices. One folder exports one.
struct Family {
  std::string_view name;     // as in the configuration
  std::string_view summary;  // one line for --help
  LinkKind link = LinkKind::kSerial;
  LineFormat default_line = {};      // kSerial, kModbus
  std::int64_t default_bitrate = 0;  // kCan: bit/s
  double default_poll_hz = 1000;     // of each device; 0: as fast as the bus allows
  std::size_t max_devices_per_bus = 1;
  bool has_position = true;  // false: a monitor; the configuration of axes does not apply
  std::span<const OperationSpec> operations;
  std::span<const ParameterSpec> parameters = {};  // those that read_parameters and write_parameters know
  // Returns whether the configuration of a device permits an operation of the family with at least some arguments.
  // Null: every operation. An operation that is not permitted is refused with REASON_NOT_PERMITTED.
  bool (*permits)(const BusConfig& bus, const DeviceConfig& device, std::string_view operation) = nullptr;

  // Returns the alarms that the device can report as it is configured, besides those that every driver detects. Their texts are valid as
  // long as the configuration. Emergencies of CANopen are one alarm for each name; their codes differ by the error. Null: none.
  std::vector<AlarmSpec> (*alarms)(const DeviceConfig& device) = nullptr;

  // Reads the family's own keys of a bus, before its devices; errors go into the map's list. Never null itself; a
  // family without such keys leaves it out.
  std::shared_ptr<const FamilyBus> (*parse_bus)(ConfigMap& map, const BusConfig& bus) = nullptr;
  // Reads the family's own keys of one device, of a bus whose link and own keys are known. Never null.
  std::unique_ptr<DeviceSettings> (*parse)(ConfigMap& device, const BusConfig& bus) = nullptr;
  // What the devices of one bus must agree on; may be left out.
  void (*check_bus)(ConfigMap& map, const BusConfig& bus) = nullptr;
  std::unique_ptr<Device> (*make_device)(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                                         SecretSource& secrets) = nullptr;
  // Simulates all devices of the bus; reads the bus's `simulate` keys (checked by check-config too).
  // Null when a key is wrong: the errors are in the map's list.
  std::unique_ptr<Simulator> (*make_simulator)(const BusConfig& bus, ConfigMap& simulate) = nullptr;

  // Returns one captured frame, request or reply, as the flat JSON object of docs/decode.md. Fails if `settings`
  // contains an unknown key or a bad value.
  Result<nlohmann::ordered_json> (*decode)(const DecodeSettings& settings, Bytes frame) = nullptr;
};

// Every family that was built, by folder name. Defined by the build (cmake/axlecast.cmake).
[[nodiscard]] std::span<const Family* const> Families();
// Returns the family of that name; null if none was built.
[[nodiscard]] inline const Family* FindFamily(std::string_view name) {
  for (const Family* family : Families()) {
    if (family->name == name) return family;
  }
  return nullptr;
}

}  // namespace axlecast
