#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/config/machine_config.h"
#include "core/device/can.h"
#include "drivers/saa_can/codec.h"

namespace axlecast::saa_can {

enum class Mode : std::uint8_t {
  kCyclic,  // the encoder sends by itself
  kSingle,  // each position is requested
};

// The family's keys of a bus: README.md, "Configuration".
struct SaaCanBus final : FamilyBus {
  // One encoder, alone on its bus, may be given another node id or bit rate. All frames of the bus are then received.
  bool bench = false;
};

// The keys of one device.
struct SaaCanSettings final : DeviceSettings {
  Format format;
  std::uint8_t node = kFactoryNode;
  Mode mode = Mode::kCyclic;
  bool start = true;  // 01 NN is sent when the link comes up, and when the encoder is silent
  MonoNs period = 0;  // kCyclic: nominal, of the positions
  std::optional<std::uint8_t> set_per_second;  // kCyclic: TT that is sent when the link comes up
  std::optional<std::uint8_t> stop_byte;       // TT that stops
  std::optional<std::uint8_t> positive_byte;   // D2 of 22 NN
  std::optional<std::uint8_t> negative_byte;   // likewise
  MonoNs timeout = 0;                          // kSingle: from the request to the position
  MonoNs latency = 0;                          // longest time from sampling to the frame's first bit
  MonoNs reply_window = 0;                     // from a command on the bus to its reply, at most
  MonoNs zero_settle = 0;                      // from clearing to zero to a reading that shows it
  CanFrameTime wire;                           // of the bus; zero if it is simulated
  std::int64_t wire_bitrate = 0;               // of the bus
  std::string iface;                           // for texts
};

// For Family. Errors go into the map's list; never null. `model: cia406` is read by drivers/cia406.
[[nodiscard]] std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus);
[[nodiscard]] std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus);
// Checks that no two devices share an identifier, and that a bench has one device.
void CheckBus(ConfigMap& map, const BusConfig& bus);

[[nodiscard]] const SaaCanBus& OwnBus(const BusConfig& bus);
// Of a device that is not of model cia406.
[[nodiscard]] const SaaCanSettings& Own(const DeviceConfig& device);

// Returns TT of a period: a whole number of positions a second, 1 to 255; nothing for another period.
[[nodiscard]] std::optional<std::uint8_t> PerSecond(std::int64_t period_ms);

inline constexpr std::size_t kMaxDevices = 32;  // on one bus

// Returns the maximum distance from 0 that an encoder at rest may read after clearing to zero: 0.2 degrees, or two counts
// if that is more. The manual gives no tolerance; a shaft counts as at rest within 0.1 degrees.
[[nodiscard]] std::int64_t ZeroToleranceCounts(int bits);

}  // namespace axlecast::saa_can
