#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {

using namespace canopen;

// How positions come.
enum class Mode : std::uint8_t {
  kCyclic,  // in TPDO1, by the encoder's own settings
  kSync,    // in TPDO1, after each SYNC that the driver sends
  kPolled,  // 6004h is read by SDO
};

// The parts of 1018h: sub-indices 1 to 4.
inline constexpr std::size_t kIdentityParts = 4;
inline constexpr std::array<const char*, kIdentityParts> kIdentityNames = {"vendor", "product", "revision",
                                                                           "serial"};

// The keys of one device: README.md, "Configuration".
struct Cia406Settings final : DeviceSettings {
  std::uint8_t node = 0;
  int bits = 0;
  int turn_bits = 0;
  Mode mode = Mode::kCyclic;
  std::uint32_t cob_id = 0;  // of TPDO1
  MonoNs period = 0;         // kCyclic: of TPDO1
  MonoNs processing = 0;     // kCyclic: longest time from sampling to the frame's first bit
  bool nmt_start = true;
  MonoNs heartbeat = 0;  // longest time between two; 0: not monitored
  MonoNs sdo_timeout = 0;
  MonoNs diagnostics = 0;  // period at which alarms are read; 0: only at the start
  MonoNs preset_settle = 0;
  std::array<std::optional<std::uint32_t>, kIdentityParts> identity;  // required

  [[nodiscard]] int total_bits() const { return bits + turn_bits; }
};

[[nodiscard]] const Cia406Settings& Own(const DeviceConfig& device);
// Returns whether this device sends SYNC for all devices of its bus.
[[nodiscard]] bool ProducesSync(const BusConfig& bus, const DeviceConfig& device);
// Returns the maximum distance from its target that an encoder at rest may read after a preset: 0.2 degrees, or two counts
// if that is more.
[[nodiscard]] std::int64_t PresetToleranceCounts(int bits);

}  // namespace axlecast::cia406
